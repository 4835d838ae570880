"""Find prose, tables, and commands to build, run and test in a README. The Markdown is never rendered."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from grader.evidence import Finding, Readme, Table
from grader.sanitize import printable

_MAX_BYTES = 256 * 1024
_MAX_TABLES, _MAX_ROWS = 20, 60

# A command may be anywhere in the text: in a code block, in a line of prose, in a list.
_COMMANDS = {
    "build": re.compile(r"\bcolcon\s+build\b"),
    "run": re.compile(r"\bros2\s+(run|launch)\s+\S+\s+\S+"),
    "test": re.compile(r"\b(colcon\s+test\b|pytest\b)"),
}
_PLACEHOLDER = re.compile(r"\b(TODO|FIXME|TBD|lorem ipsum)\b|<(your|describe|insert)\b", re.IGNORECASE)
_FENCE = re.compile(r"^\s{0,3}(```|~~~)")
_RULE = re.compile(r"^\s*\|?\s*:?-+:?\s*(\|\s*:?-+:?\s*)*\|?\s*$")


def read_readme(package: Path, files: Sequence[str]) -> Readme | None:
    """Return what README.md beside package.xml shows, None if there is none. The case of its name does not matter."""
    path = next((name for name in files if name.lower() == "readme.md"), None)
    if path is None:
        return None
    with (package / path).open("rb") as stream:
        text = stream.read(_MAX_BYTES).decode("utf-8", "replace")
    lines = text.splitlines()
    prose = _prose(lines)
    shown = {what: command.search(text) for what, command in _COMMANDS.items()}
    return Readme(
        path=path,
        words=sum(len(re.findall(r"[^\W\d_]{2,}", line)) for line in prose.values()),
        placeholders=[
            Finding(path, number, "placeholder", printable(line.strip(), 120))
            for number, line in prose.items()
            if _PLACEHOLDER.search(line)
        ][:10],
        shows={what: printable(match.group(0), 120) for what, match in shown.items() if match},
        tables=_tables(lines)[:_MAX_TABLES],
    )


def _prose(lines: Sequence[str]) -> dict[int, str]:
    """Return the lines that are not code, headings or tables, by their number."""
    found = {}
    fenced = False
    for number, line in enumerate(lines, 1):
        if _FENCE.match(line):
            fenced = not fenced
        elif not fenced and not line.startswith(("    ", "\t", "#")) and not line.lstrip().startswith("|"):
            found[number] = line
    return found


def _tables(lines: Sequence[str]) -> list[Table]:
    found = []
    number = 0
    while number + 1 < len(lines):
        head = lines[number]
        if "|" in head and "|" in lines[number + 1] and _RULE.match(lines[number + 1][:2000]):
            rows = []
            number += 2
            while number < len(lines) and "|" in lines[number]:
                rows.append(_cells(lines[number]))
                number += 1
            found.append(Table(_cells(head), rows[:_MAX_ROWS]))
        else:
            number += 1
    return found


def _cells(line: str) -> list[str]:
    """Return the cells of a row; an escaped bar belongs to its cell."""
    cells = re.split(r"(?<!\\)\|", line.strip().removeprefix("|").removesuffix("|"))
    return [printable(cell.replace("\\|", "|").strip()) for cell in cells[:20]]
