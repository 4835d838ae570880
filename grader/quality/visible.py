"""What a reader of a README sees of it: the text of the page that its Markdown makes, without what HTML may hide.

markdown-it makes the page. An attribute such as `style` or `class` may hide text in one viewer and not in another, so
what is in an element with anything but plain attributes does not count, nor does what HTML never shows as text.
"""

from __future__ import annotations

import re
from collections import defaultdict
from dataclasses import dataclass, field
from html.parser import HTMLParser

from markdown_it import MarkdownIt

_PLAIN = {
    "align", "alt", "border", "cite", "colspan", "dir", "height", "href", "id", "lang", "loading", "media", "name",
    "open", "rel", "rowspan", "sizes", "src", "srcset", "start", "target", "title", "type", "valign", "width",
}  # fmt: skip
_VOID = {"area", "base", "br", "col", "embed", "hr", "img", "input", "link", "meta", "param", "source", "track", "wbr"}
_NOT_TEXT = {
    "audio", "canvas", "datalist", "dialog", "head", "iframe", "noembed", "noframes", "noscript", "object", "rp",
    "script", "select", "style", "svg", "template", "title", "video",
}  # fmt: skip
_HEADINGS = {"h1", "h2", "h3", "h4", "h5", "h6"}
_BLOCKS = {"div", "dd", "dt", "li", "p", "pre", "summary", "td", "th", "tr", *_HEADINGS}
# A gap in a template that was not filled in. HTML takes it for an element and does not show it.
_GAP = re.compile(r"your|describe|insert")

_Attributes = list[tuple[str, str | None]]


@dataclass
class Page:
    """What is shown: all of its `text`; what of it is `prose`, by line of the source; and rows of cells by table.

    `named` is the text outside blocks of code. `left_out` are the elements whose text does not count, by line.
    """

    text: str = ""
    named: str = ""
    prose: dict[int, str] = field(default_factory=lambda: defaultdict(str))
    tables: list[list[list[str]]] = field(default_factory=list)
    left_out: dict[int, str] = field(default_factory=dict)


def visible(text: str) -> Page:
    """Return the page that a Markdown text makes."""
    markdown = MarkdownIt("commonmark").enable("table")
    pieces, lines = [], [1]
    for token in markdown.parse(text):
        if token.map:
            lines[-1] = token.map[0] + 1
        # The class of a block's language and the style of a column are ours, not the author's.
        token.attrs, token.info = {}, ""
        pieces.append(markdown.renderer.render([token], markdown.options, {}))
        lines += [lines[-1] + number + 1 for number in range(pieces[-1].count("\n"))]
    reader = _Reader(lines)
    reader.feed("".join([*pieces, "-->"]))  # ends a comment that the author left open
    reader.close()
    return reader.page()


class _Reader(HTMLParser):
    """Reads a page; `lines` are the lines of the source at which those of the page begin."""

    def __init__(self, lines: list[int]) -> None:
        super().__init__()
        self._lines = lines
        self._page = Page()
        self._text: list[str] = []
        self._named: list[str] = []
        self._block = ""
        self._cell: list[str] | None = None
        self._hiding, self._depth = "", 0
        """The name of the outermost element here that hides what is in it, and how many of that name are open."""

    def page(self) -> Page:
        """Return what was read."""
        self._page.text, self._page.named = "".join(self._text), "".join(self._named)
        self._end_cell()
        return self._page

    def handle_starttag(self, tag: str, attrs: _Attributes) -> None:
        """Begin a block, a cell, or what is hidden."""
        line = self._lines[self.getpos()[0] - 1]
        if tag in _VOID:
            if tag == "br":
                self.handle_data("\n")
        elif self._hiding:
            self._depth += tag == self._hiding
        elif _hides(tag, attrs):
            self._hiding, self._depth = tag, 1
            self._page.left_out.setdefault(line, self.get_starttag_text() or tag)
        elif _GAP.match(tag):
            self._page.prose[line] += self.get_starttag_text() or ""
        elif tag in _BLOCKS:
            self._block = tag
            self._text.append("\n")
            if tag in ("td", "th", "tr"):
                self._end_cell()
                if tag == "tr" and self._page.tables:
                    self._page.tables[-1].append([])
                self._cell = None if tag == "tr" else []
        elif tag == "table":
            self._page.tables.append([])

    def handle_startendtag(self, tag: str, attrs: _Attributes) -> None:
        """Begin an element: HTML closes none with "/>"."""
        self.handle_starttag(tag, attrs)

    def handle_endtag(self, tag: str) -> None:
        """End what begins with the tag."""
        if self._hiding:
            self._depth -= tag == self._hiding
            self._hiding = self._hiding if self._depth else ""
        elif tag in _BLOCKS or tag == "table":
            self._block = ""
            self._text.append("\n")
            if tag in ("td", "th", "tr", "table"):
                self._end_cell()

    def handle_data(self, data: str) -> None:
        """Keep what is shown."""
        if self._hiding:
            return
        self._text.append(data)
        if self._block != "pre":
            self._named.append(data)
        if self._cell is not None:
            self._cell.append(data)
        elif self._block != "pre" and self._block not in _HEADINGS:
            first = self.getpos()[0] - 1
            for number, part in enumerate(data.split("\n")):
                self._page.prose[self._lines[min(first + number, len(self._lines) - 1)]] += part

    def parse_marked_section(self, i: int, report: bool = True) -> int:
        """Take "<![" as browsers do: a comment up to the next ">"."""
        return self.parse_bogus_comment(i, report)

    def _end_cell(self) -> None:
        tables = self._page.tables
        if self._cell is not None and tables and tables[-1]:
            tables[-1][-1].append("".join(self._cell).strip().replace("\n", " , "))
        self._cell = None


def _hides(tag: str, attrs: _Attributes) -> bool:
    """Return whether a viewer may hide what is in an element. `<path to it>` is a gap, with words for attributes."""
    odd = [(name, value) for name, value in attrs if name not in _PLAIN]
    return tag in _NOT_TEXT or any(value is not None or name in ("hidden", "popover") for name, value in odd)
