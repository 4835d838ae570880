"""Make text that may come from a submission safe to show. Pure: strings in, strings out."""

from __future__ import annotations

import dataclasses
import unicodedata
from collections.abc import Mapping
from enum import Enum
from typing import Any, TypeVar

T = TypeVar("T")

# People read reports: text longer than this is a log, or an attack on the reader's browser.
NAME_LIMIT = 200
LINE_LIMIT = 1_000
TEXT_LIMIT = 8_000

# More marks stacked on one letter than any script uses would paint over the lines around them.
MARKS_LIMIT = 3

# Control, format (bidi overrides, zero-width), surrogate, private, unassigned; line and paragraph separators.
_UNSEEN = frozenset({"Cc", "Cf", "Cs", "Co", "Cn", "Zl", "Zp"})

# Only in these fields a line break is a new line; elsewhere it would let a name fake a line of the report.
_SEVERAL_LINES = frozenset(
    {"sentence", "seen", "expected", "try_", "because", "what", "note", "notes", "failures", "log_tail", "output_tail"}
)

# Of a log the end is kept: it shows what went wrong.
_TAILS = frozenset({"log_tail", "output_tail"})


def printable(text: str, most: int = NAME_LIMIT) -> str:
    """Return `text` as one line of at most `most` characters, with invisible characters escaped."""
    shown = _visible(text[: most + 1])
    return shown if len(shown) <= most else shown[: most - 1] + "…"


def one_line(text: str, limit: int = NAME_LIMIT) -> str:
    """Return `text` as one line of about `limit` characters at most, with invisible characters escaped."""
    return _visible(_cut(text, limit))


def prose(text: str, limit: int = LINE_LIMIT) -> str:
    """Return a text of several lines as one line: a blank in place of each line break, the rest as by `one_line`."""
    return one_line(" ".join(text.split()), limit)


def lines(text: str, limit: int = TEXT_LIMIT, *, tail: bool = False) -> str:
    """Return `text` with its line breaks, each line and the whole cut to size, with invisible characters escaped.

    With `tail` the end of the text is kept instead of its beginning.
    """
    kept = _cut(text, limit, tail=tail).replace("\r\n", "\n").split("\n")
    return "\n".join(_visible(_cut(line, LINE_LIMIT).expandtabs(4)) for line in kept)


def shown(fact: T, trusted: tuple[type, ...] = ()) -> T:
    """Return a dataclass, list, tuple or mapping with every string in it made safe to show.

    Values of the types in `trusted`, such as the rubric's own, stay as they are.

    Apply it once: text that was cut says so, and would be cut again.
    """
    result: Any = _shown(fact, "", (Enum, *trusted))
    return result  # type: ignore[no-any-return]  # the same type as went in, which mypy cannot follow


def _shown(fact: Any, name: str, trusted: tuple[type, ...]) -> Any:
    if isinstance(fact, trusted):
        return fact
    if isinstance(fact, str):
        return lines(fact, tail=name in _TAILS) if name in _SEVERAL_LINES else one_line(fact)
    if dataclasses.is_dataclass(fact) and not isinstance(fact, type):
        values = {f.name: getattr(fact, f.name) for f in dataclasses.fields(fact) if f.init}
        return dataclasses.replace(fact, **{key: _shown(v, key, trusted) for key, v in values.items()})
    if isinstance(fact, Mapping):
        return {_shown(key, "", trusted): _shown(v, name, trusted) for key, v in fact.items()}
    if isinstance(fact, list | tuple):
        return type(fact)(_shown(item, name, trusted) for item in fact)
    return fact


def _cut(text: str, limit: int, *, tail: bool = False) -> str:
    if len(text) <= limit:
        return text
    note = f"({len(text) - limit:,} characters more)"
    return f"{note} … {text[-limit:]}" if tail else f"{text[:limit]} … {note}"


def _visible(text: str) -> str:
    if text.isascii() and text.isprintable():
        return text
    result, marks = [], 0
    for character in text:
        category = unicodedata.category(character)
        marks = marks + 1 if category in ("Mn", "Me") else 0
        hidden = category in _UNSEEN or marks > MARKS_LIMIT
        result.append(character.encode("unicode_escape").decode("ascii") if hidden else character)
    return "".join(result)
