"""Compare the text of an interface definition (.msg, .srv, .action) with the contract's, field by field."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

_SECTIONS = {"msg": ("message",), "srv": ("request", "response"), "action": ("goal", "result", "feedback")}
_SEPARATOR = "---"
_MAX_LINES = 500  # far above what people write
_TYPE = re.compile(r"(?P<name>(?:[a-z]\w*/(?:msg/)?)?[A-Z][A-Za-z0-9]*|[a-z]+\d*)(?:<=\d+)?(?:\[(?:<=)?\d*\])?")


@dataclass(frozen=True)
class _Field:
    line: int
    type: str
    name: str

    @property
    def text(self) -> str:
        return f"{self.type} {self.name}".strip()


def differences(kind: str, found: str, wanted: str) -> list[tuple[int, str]]:
    """Return how a definition differs from the contract's: (line, words), the line 0 for what is not there.

    `kind` is "msg", "srv" or "action". Comments, spaces and the short form of a type (`geometry_msgs/Pose` for
    `geometry_msgs/msg/Pose`) make no difference.
    """
    theirs, ours = _sections(found), _sections(wanted)
    if len(theirs) != len(ours):
        return [(0, f"it has {len(theirs) - 1} of the lines `---` between its parts, and needs {len(ours) - 1}")]
    named = zip(_SECTIONS[kind], theirs, ours, strict=True)
    return [difference for section, their, our in named for difference in _in_section(section, their, our)]


def packages(text: str) -> list[tuple[int, str]]:
    """Return the packages that the types of a definition's fields are from: (line, package)."""
    fields = [field for section in _sections(text) for field in section if "/" in field.type]
    return [(field.line, field.type.partition("/")[0]) for field in fields if _TYPE.fullmatch(field.type)]


def parts(text: str) -> list[dict[str, str]]:
    """Return the parts of a definition, such as request and response: their fields by name, with their types."""
    return [{field.name: field.type for field in section} for section in _sections(text)]


def _sections(text: str) -> list[list[_Field]]:
    sections: list[list[_Field]] = [[]]
    for number, line in enumerate(text.splitlines()[:_MAX_LINES], 1):
        code = line.partition("#")[0].split()
        if code == [_SEPARATOR]:
            sections.append([])
        elif code:
            sections[-1].append(_Field(number, _long(code[0]), " ".join(code[1:])))
    return sections


def _long(type_: str) -> str:
    """Return a type as the contract writes it."""
    package, _, name = type_.replace("/msg/", "/").rpartition("/")
    return "std_msgs/Header" if name == "Header" and not package else "/".join(filter(None, (package, name)))


def _in_section(section: str, theirs: list[_Field], ours: list[_Field]) -> Iterator[tuple[int, str]]:
    by_name = {field.name: field for field in theirs}
    wanted = {field.name: field for field in ours}
    missing = [field for field in ours if field.name not in by_name]
    extra = [field for field in theirs if field.name not in wanted]
    for field in theirs:
        right = wanted.get(field.name)
        if right is not None and right.type != field.type:
            yield field.line, f"`{field.text}` should be `{right.text}`"
    # A field of the right type in the place of a missing one has another name.
    for lost in [*missing]:
        place = ours.index(lost)
        other = theirs[place] if place < len(theirs) else None
        if other in extra and other is not None and other.type == lost.type:
            yield other.line, f"`{other.text}` should be `{lost.text}`"
            missing.remove(lost)
            extra.remove(other)
    for lost in missing:
        yield 0, f"`{lost.text}` is missing from the {section}"
    for field in extra:
        yield field.line, f"`{field.text}` is not in the contract's {section}"
    order = [field.name for field in theirs if field.name in wanted]
    if not missing and not extra and order != [name for name in wanted if name in by_name]:
        yield theirs[0].line, f"the fields of the {section} are not in the contract's order: {', '.join(wanted)}"
