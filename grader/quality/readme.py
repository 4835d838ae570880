"""Find prose, tables, and commands to build, run and test in what a reader of a README sees."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection, Sequence
from pathlib import Path

from grader.evidence import Finding, Readme, Table
from grader.quality.visible import visible
from grader.sanitize import printable

_MAX_BYTES = 256 * 1024
_MAX_TABLES, _MAX_ROWS, _MAX_CELLS = 20, 60, 20

# A command may be anywhere in the text: in a code block, in a line of prose, in a list.
_COMMANDS = {
    "build": re.compile(r"\bcolcon\s+build\b"),
    "run": re.compile(r"\bros2\s+(?:run|launch)\s+(?:-\S+\s+)*(?:\S*[_.]launch\.py\b|(?P<package>[\w<>${}-]+)\s+\S+)"),
    "test": re.compile(r"\b(colcon\s+test\b|pytest\b)"),
}
_PLACEHOLDER = re.compile(r"\b(TODO|FIXME|TBD|lorem ipsum)\b|<(your|describe|insert)\b", re.IGNORECASE)
_WORD = re.compile(r"[^\W\d_]{2,}")
_TIMES = 3  # that a word counts: twenty times the same one says nothing


def read_readme(package: Path, files: Sequence[str], names: Collection[str], own: Collection[str]) -> Readme | None:
    """Return what README.md beside package.xml shows, None if there is none. The case of its name does not matter.

    `names` are the package's names: a command that starts something of another package does not run this one. `own` are
    those of what is in it, of which a text about it has one.
    """
    path = next((name for name in files if name.lower() == "readme.md"), None)
    if path is None:
        return None
    with (package / path).open("rb") as stream:
        text = stream.read(_MAX_BYTES).decode("utf-8", "replace")
    # As str.splitlines would count them, so that the numbers are those of an editor.
    page = visible("\n".join(text.splitlines()))
    commands = {what: _command(what, page.text, names) for what in _COMMANDS}
    words = Counter(word.lower() for line in page.prose.values() for word in _WORD.findall(line))
    said = _spaced(page.named)
    return Readme(
        path=path,
        words=sum(min(count, _TIMES) for count in words.values()),
        placeholders=[
            Finding(path, number, "placeholder", printable(line.strip(), 120))
            for number, line in sorted(page.prose.items())
            if _PLACEHOLDER.search(line)
        ][:10],
        shows={what: printable(command, 120) for what, command in commands.items() if command},
        tables=[_table(rows) for rows in page.tables if rows][:_MAX_TABLES],
        is_about_package=any(_spaced(name) in said for name in (*names, *own)),
        left_out=[
            Finding(path, number, "left out", printable(tag, 120)) for number, tag in sorted(page.left_out.items())
        ][:10],
    )


def _spaced(text: str) -> str:
    """Return the words of a text, "robot controller" for `robot_controller`, with a space before each."""
    return " " + " ".join(re.findall(r"[^\W_]+", text.lower()))


def _command(what: str, text: str, names: Collection[str]) -> str:
    """Return the first command of a kind that is about this package, "" if there is none."""
    for match in _COMMANDS[what].finditer(text):
        package = match.groupdict().get("package")
        # "<package>" and "$PACKAGE" may be any package, this one too.
        if not package or package in names or not re.fullmatch(r"[\w-]+", package):
            return match.group(0)
    return ""


def _table(rows: Sequence[Sequence[str]]) -> Table:
    head, *body = ([printable(cell) for cell in row[:_MAX_CELLS]] for row in rows[: _MAX_ROWS + 1])
    return Table(head, body)
