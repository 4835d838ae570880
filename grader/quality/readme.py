"""What a reader of the page that a README makes sees of it: prose, tables, and commands to build, run and test.

markdown-it makes the page. What is in a comment, in an element that shows no text, or in one that its attributes may
hide does not count; its words are counted apart.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from html.parser import HTMLParser
from pathlib import Path

from markdown_it import MarkdownIt

from grader.evidence import Finding, Readme, Table
from grader.sanitize import printable

_MAX_BYTES = 256 * 1024
_MAX_TABLES, _MAX_ROWS, _MAX_CELLS = 20, 60, 20

# A command may be anywhere in the text: in a code block, in a line of prose, in a list.
_COMMANDS = {
    "build": re.compile(r"\bcolcon\s+build\b"),
    "run": re.compile(r"\bros2\s+(?:run|launch)\s+(?:-\S+\s+)*(?:\S*[_.]launch\.py\b|(?P<package>[\w<>${}-]+)\s+\S+)"),
    "test": re.compile(r"\b(colcon\s+test\b|pytest\b)"),
}
_PLACEHOLDER = re.compile(r"\b(TODO|FIXME|TBD|lorem ipsum)\b", re.IGNORECASE)
_WORD = re.compile(r"[^\W\d_]{2,}")
_CELLS = ("td", "th")
_NOT_PROSE = {"pre", "h1", "h2", "h3", "h4", "h5", "h6", *_CELLS}
_BLOCKS = {"div", "dd", "dt", "li", "p", "summary", "table", "tr", *_NOT_PROSE}
_VOID = {"area", "base", "br", "col", "embed", "hr", "img", "input", "link", "meta", "source", "track", "wbr"}
_NOT_TEXT = {"dialog", "head", "iframe", "noscript", "object", "script", "select", "style", "svg", "template", "title"}
_MAY_HIDE = {"class", "color", "hidden", "popover", "style"}


def read_readme(package: Path, files: Sequence[str], names: Collection[str]) -> Readme | None:
    """Return what README.md beside package.xml shows, None if there is none. The case of its name does not matter.

    `names` are the package's names: a command that starts something of another package does not run this one.
    """
    path = next((name for name in files if name.lower() == "readme.md"), None)
    if path is None:
        return None
    with (package / path).open("rb") as stream:
        # As str.splitlines would count them, so that the numbers are those of an editor.
        lines = stream.read(_MAX_BYTES).decode("utf-8", "replace").splitlines()
    page = _Page("\n".join(lines))
    commands = {what: _command(what, page.text, names) for what in _COMMANDS}
    left = ((number, line, _PLACEHOLDER.search(line)) for number, line in enumerate(lines, 1))
    return Readme(
        path=path,
        words=len(_WORD.findall(page.prose)),
        placeholders=[
            Finding(path, number, "placeholder", printable(line.strip(), 120))
            for number, line, found in left
            if found and found[0] in page.prose
        ][:10],
        shows={what: printable(command, 120) for what, command in commands.items() if command},
        tables=[_table(rows) for rows in page.tables if rows][:_MAX_TABLES],
        hidden=len(_WORD.findall(page.hidden)),
    )


def _command(what: str, text: str, names: Collection[str]) -> str:
    """Return the first command of a kind that is about this package, "" if there is none."""
    for match in _COMMANDS[what].finditer(text):
        package = match.groupdict().get("package")
        # "<package>" and "$PACKAGE" may be any package, this one too.
        if not package or package in names or not re.fullmatch(r"[\w-]+", package):
            return match.group(0)
    return ""


def _table(rows: Sequence[Sequence[str]]) -> Table:
    head, *body = ([printable(cell.strip()) for cell in row[:_MAX_CELLS]] for row in rows[: _MAX_ROWS + 1])
    return Table(head, body)


class _Page(HTMLParser):
    """A page taken apart: all text that is shown, what of it is prose, what is hidden, and rows of cells by table."""

    def __init__(self, markdown: str) -> None:
        """Read the page that a Markdown text makes."""
        super().__init__()
        self.text = self.prose = self.hidden = ""
        self.tables: list[list[list[str]]] = []
        self._block = ""
        self._hiding: list[str] = []
        """The elements that are open here, from the one on that hides what is in it."""
        maker = MarkdownIt("commonmark").enable("table")
        tokens = maker.parse(markdown)
        for token in tokens:
            # The class of a block's language and the style of a column are ours, not the author's.
            token.attrs, token.info = {}, ""
        self.feed(maker.renderer.render(tokens, maker.options, {}) + "-->")  # ends a comment that was left open
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Begin a block, a cell, or what is hidden."""
        if tag in _VOID:
            self.handle_data("\n" if tag == "br" else "")
        elif self._hiding or tag in _NOT_TEXT or any(name in _MAY_HIDE for name, _ in attrs):
            self._hiding.append(tag)
        elif tag in _BLOCKS:
            self._begin(tag)
            if tag == "table":
                self.tables.append([])
            elif tag == "tr" and self.tables:
                self.tables[-1].append([])
            elif tag in _CELLS and self.tables and self.tables[-1]:
                self.tables[-1][-1].append("")

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Begin an element: HTML closes none with "/>"."""
        self.handle_starttag(tag, attrs)

    def handle_endtag(self, tag: str) -> None:
        """End what begins with the tag, and all in it that was left open."""
        if tag in self._hiding:
            del self._hiding[len(self._hiding) - 1 - self._hiding[::-1].index(tag) :]
        elif not self._hiding and tag in _BLOCKS:
            self._begin("")

    def handle_data(self, data: str) -> None:
        """Keep text."""
        if self._hiding:
            self.hidden += data
            return
        self.text += data
        if self._block not in _NOT_PROSE:
            self.prose += data
        elif self._block in _CELLS and self.tables and self.tables[-1] and self.tables[-1][-1]:
            self.tables[-1][-1][-1] += data.replace("\n", " , ")

    def handle_comment(self, data: str) -> None:
        """Keep what nobody sees."""
        self.hidden += data

    def parse_marked_section(self, i: int, report: bool = True) -> int:
        """Take "<![" as browsers do: a comment up to the next ">"."""
        return self.parse_bogus_comment(i, report)

    def _begin(self, block: str) -> None:
        self._block = block
        self.text += "\n"
        self.prose += "\n"
