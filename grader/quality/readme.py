"""Find prose, tables, and commands to build, run and test in what a reader of a README sees."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from pathlib import Path

from grader.evidence import Finding, Readme, Table
from grader.quality.visible import visible
from grader.sanitize import printable

_MAX_BYTES = 256 * 1024
_MAX_TABLES, _MAX_ROWS = 20, 60

# A command may be anywhere in the text: in a code block, in a line of prose, in a list.
_COMMANDS = {
    "build": re.compile(r"\bcolcon\s+build\b"),
    "run": re.compile(r"\bros2\s+(?:run|launch)\s+(?:-\S+\s+)*(?:\S*[_.]launch\.py\b|(?P<package>[\w<>${}-]+)\s+\S+)"),
    "test": re.compile(r"\b(colcon\s+test\b|pytest\b)"),
}
_PLACEHOLDER = re.compile(r"\b(TODO|FIXME|TBD|lorem ipsum)\b|<(your|describe|insert)\b", re.IGNORECASE)
_RULE = re.compile(r"^\s*\|?\s*:?-+:?\s*(\|\s*:?-+:?\s*)*\|?\s*$")


def read_readme(package: Path, files: Sequence[str], names: Collection[str]) -> Readme | None:
    """Return what README.md beside package.xml shows, None if there is none. The case of its name does not matter.

    `names` are the package's names: a command that starts something of another package does not run this one.
    """
    path = next((name for name in files if name.lower() == "readme.md"), None)
    if path is None:
        return None
    with (package / path).open("rb") as stream:
        text = stream.read(_MAX_BYTES).decode("utf-8", "replace")
    # As str.splitlines would count them, so that the numbers are those of an editor.
    shown = visible("\n".join(text.splitlines()))
    lines = [line for line, _ in shown]
    prose = {number: line for number, (line, is_code) in enumerate(shown, 1) if not is_code and _is_prose(line)}
    commands = {what: _command(what, "\n".join(lines), names) for what in _COMMANDS}
    return Readme(
        path=path,
        words=sum(len(re.findall(r"[^\W\d_]{2,}", line)) for line in prose.values()),
        placeholders=[
            Finding(path, number, "placeholder", printable(line.strip(), 120))
            for number, line in prose.items()
            if _PLACEHOLDER.search(line)
        ][:10],
        shows={what: printable(command, 120) for what, command in commands.items() if command},
        tables=_tables(lines)[:_MAX_TABLES],
    )


def _command(what: str, text: str, names: Collection[str]) -> str:
    """Return the first command of a kind that is about this package, "" if there is none."""
    for match in _COMMANDS[what].finditer(text):
        package = match.groupdict().get("package")
        # "<package>" and "$PACKAGE" may be any package, this one too.
        if not package or package in names or not re.fullmatch(r"[\w-]+", package):
            return match.group(0)
    return ""


def _is_prose(line: str) -> bool:
    return not line.startswith(("    ", "\t", "#")) and not line.lstrip().startswith("|")


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
