"""What a reader of a rendered README sees of its Markdown. Nothing is rendered: what does not show is blanked.

Not shown are comments, tags and their attributes, elements that are hidden, empty or white, link targets, reference
definitions, and what an image says in place of a picture. Code is shown as it is, whatever it holds.
"""

from __future__ import annotations

import re

_FENCE = re.compile(r" {0,3}(`{3,}|~{3,})([^\n]*)")
_LIST = re.compile(r"\s*(?:[-*+]|\d{1,9}[.)])\s")
# Only a link definition that is valid is left out when rendered; a footnote ([^1]: ...) is shown.
_DEFINITION = re.compile(
    r""" {0,3}\[(?!\^)[^\]\n]{1,300}\]:[ \t]*\n?[ \t]*(?:<[^>\n]{0,500}>|\S{1,500})"""
    r"""(?:[ \t]*\n?[ \t]+(?:"[^"]{0,2000}"|'[^']{0,2000}'|\([^()]{0,2000}\)))?[ \t]*$""",
    re.MULTILINE,
)
_TAG = re.compile(r"""<(/?)([A-Za-z][\w-]{0,40})((?=[\s/>])(?:[^<>"']|"[^"]{0,500}"|'[^']{0,500}'){0,1000})>""")
# `<your name>` is not shown either, but it is a gap in a template that was not filled in.
_GAP = re.compile(r"your|describe|insert", re.IGNORECASE)
_DECLARATION = re.compile(r"<\?[^>]{0,500}\?>|<!\[CDATA\[.{0,500}?\]\]>|<![A-Za-z][^>]{0,500}>", re.DOTALL)
_IMAGE = re.compile(r"!\[[^\]\n]{0,300}\](?:\([^()\n]{0,500}\)|\[[^\]\n]{0,100}\])?")
_TARGET = re.compile(r"""(?<=\])\((?:<[^>\n]{0,500}>|[^\s()]{0,500})(?:\s+(?:"[^"\n]{0,500}"|'[^'\n]{0,500}'))?\s*\)""")
_CODE = re.compile(r"(?<!`)(`+)(?!`)[^\n]*?(?<!`)\1(?!`)")
_SPECIAL = {
    "`": (("code", _CODE),),
    "<": (("tag", _TAG), ("", _DECLARATION)),
    "!": (("", _IMAGE),),
    "(": (("", _TARGET),),
}
_VOID = {"area", "base", "br", "col", "embed", "hr", "img", "input", "link", "meta", "source", "track", "wbr"}
_NEVER_SHOWN = {
    "audio", "canvas", "datalist", "head", "iframe", "noembed", "noframes", "noscript", "object", "script", "style",
    "template", "title", "video",
}  # fmt: skip
_NOTHING = r"0(?:\.0*)?(?:px|r?em|pt|%)?"
_HIDES = re.compile(
    rf"""(?:^|[\s"';])(?:
      hidden(?=[\s=/]|$)
    | display\s*:\s*none | visibility\s*:\s*(?:hidden|collapse)
    | (?:font-size|opacity|(?:max-)?width|(?:max-)?height)\s*:\s*{_NOTHING}\s*(?=[;"'!]|$)
    | (?:width|height|font-size)\s*=\s*["']?{_NOTHING}["']?(?=[\s/]|$)
    | color\s*[:=]\s*["']?(?:white\b|transparent\b|\#fff(?:fff)?\b
      | rgba?\(\s*255\s*,\s*255\s*,\s*255|rgba\([^)]*,\s*0\s*\))
    | (?:left|top|right|bottom|text-indent|margin(?:-\w+)?)\s*:\s*-\d{{3,}}
    )""",
    re.IGNORECASE | re.VERBOSE,
)
_SPACE = re.compile(r"\S")


def visible(text: str) -> list[tuple[str, bool]]:
    """Return each line of a Markdown text as a reader sees it, and whether it is in a block of code."""
    return _Page(text).lines()


class _Page:
    """Goes through a text once, and notes what is not shown."""

    def __init__(self, text: str) -> None:
        self._text = text
        self._shown: list[str] = []
        self._code_lines: set[int] = set()
        self._hiding: list[str] = []
        """The names of the elements around this place, from the first one on that hides what is in it."""
        self._closes = "-->" in text
        self._line = 0
        self._in_list = False
        self._after_blank = True

    def lines(self) -> list[tuple[str, bool]]:
        place = 0
        while place < len(self._text):
            place = self._block(place)
        lines = "".join(self._shown).split("\n")
        return [(line, number in self._code_lines) for number, line in enumerate(lines)]

    def _block(self, place: int) -> int:
        """Take what begins with the line at `place`; return where the rest begins."""
        end = self._end_of_line(place)
        line = self._text[place:end]
        fence = _FENCE.match(self._text, place)
        if fence and not (fence[1][0] == "`" and "`" in fence[2]):
            return self._fenced(place, fence)
        if definition := _DEFINITION.match(self._text, place):
            return self._to(definition.end(), shown=False, start=place)
        if line.startswith(("    ", "\t")) and self._after_blank and not self._in_list and line.strip():
            self._code_lines.add(self._line)
            return self._to(min(end + 1, len(self._text)), shown=True, start=place)
        if line.strip():
            self._in_list = bool(_LIST.match(line)) or (self._in_list and line.startswith((" ", "\t")))
        self._after_blank = not line.strip()
        return self._inline(place, end)

    def _fenced(self, place: int, fence: re.Match[str]) -> int:
        closing = re.compile(rf"^ {{0,3}}{re.escape(fence[1][0])}{{{len(fence[1])},}}[ \t]*$", re.MULTILINE)
        end = self._end_of_line(place)
        self._to(fence.end(1), shown=True, start=place)
        self._to(end, shown=False, start=fence.end(1))
        found = closing.search(self._text, end)
        stop = self._end_of_line(found.start()) if found else len(self._text)
        first = self._line
        self._to(stop, shown=True, start=end)
        self._code_lines |= set(range(first, self._line + 1))
        self._after_blank = True
        return stop if stop == len(self._text) else self._to(stop + 1, shown=True, start=stop)

    def _inline(self, place: int, end: int) -> int:
        """Take a line of text, and what goes on from it over more lines."""
        first = place
        while place < end:
            if self._text.startswith("<!--", place):
                place = self._comment(place, at_start=not self._text[first:place].strip())
                if place > end:
                    return place
                continue
            match = self._special(place)
            if match is None:
                following = re.compile(r"[<!`\](]").search(self._text, place + 1, end)
                stop = following.start() if following else end
                place = self._to(stop, shown=True, start=place)
                continue
            kind, found = match
            place = self._to(found.end(), shown=kind == "code", start=place)
            if kind == "tag":
                self._tag(found)
            if place > end:
                return place
        return self._to(min(end + 1, len(self._text)), shown=True, start=place)

    def _special(self, place: int) -> tuple[str, re.Match[str]] | None:
        kinds = {
            "`": [("code", _CODE)],
            "<": [("tag", _TAG), ("", _DECLARATION)],
            "!": [("", _IMAGE)],
            "(": [("", _TARGET)],
        }
        for kind, pattern in kinds.get(self._text[place], []):
            found = pattern.match(self._text, place)
            if found and not (kind == "tag" and _GAP.match(found[2])):
                return kind, found
        return None

    def _comment(self, place: int, *, at_start: bool) -> int:
        end = self._text.find("-->", place) if self._closes else -1
        if end < 0:
            self._closes = False
            # At the start of a line a comment that is not closed goes on to the end; elsewhere it is text.
            return self._to(len(self._text) if at_start else place + 4, shown=not at_start, start=place)
        return self._to(end + 3, shown=False, start=place)

    def _tag(self, tag: re.Match[str]) -> None:
        closing, name, attributes = tag[1], tag[2].lower(), tag[3]
        if name in _VOID or attributes.endswith("/"):
            return
        if not closing and (self._hiding or name in _NEVER_SHOWN or _HIDES.search(attributes)):
            self._hiding.append(name)
        elif closing and name in self._hiding:
            last = len(self._hiding) - 1 - self._hiding[::-1].index(name)
            del self._hiding[last:]

    def _to(self, end: int, *, shown: bool, start: int) -> int:
        """Show or blank the text up to `end`, and return `end`."""
        piece = self._text[start:end]
        self._shown.append(piece if shown and not self._hiding else _SPACE.sub(" ", piece))
        self._line += piece.count("\n")
        return end

    def _end_of_line(self, place: int) -> int:
        end = self._text.find("\n", place)
        return len(self._text) if end < 0 else end
