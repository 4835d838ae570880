"""What students read, in the language of the course: each text is looked up in a catalogue when it is said.

Texts are English in the code. `grader/locale` has the kit's catalogues, and a course may have one of its own, as
`words/de.po`; both are read as they are. What a submission has printed or is called is a field, never a text.
"""

from __future__ import annotations

import gettext as _gettext
import io
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from string import Formatter
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from jinja2 import Environment

ENGLISH = "en"
LOCALE = Path(__file__).parent / "locale"
MOST_SHOWN = 10
"""How many things of one kind are named before the others are only counted."""


@dataclass(frozen=True)
class _Language:
    code: str
    catalogue: _gettext.NullTranslations
    point: str  # the decimal point


_spoken = _Language(ENGLISH, _gettext.NullTranslations(), ".")


def languages() -> list[str]:
    """Return the languages that the kit has words in, English first."""
    return [ENGLISH, *sorted(path.name for path in LOCALE.glob("*") if path.is_dir())]


def speak(code: str, course: Path) -> None:
    """Say everything in a language from here on, with the catalogues that are in the folders of the course."""
    global _spoken
    _spoken = _read(code, course)


def spoken() -> str:
    """Return the code of the language in use, such as "de"."""
    return _spoken.code


def gettext(text: str) -> str:
    """Return a text in the language in use, with its fields as they are."""
    return _spoken.catalogue.gettext(text) if text else ""


def ngettext(one: str, many: str, n: int) -> str:
    """Return the text for the number `n` in the language in use."""
    return _spoken.catalogue.ngettext(one, many, n)


def say(text: str, /, **fields: object) -> str:
    """Return a text in the language in use, with its fields filled in: `say("no {topic} came", topic="scan")`.

    Numbers get the decimal point of the language. Where they are code, `{speed!s}` leaves them as they are.
    """
    return _FILLS.vformat(gettext(text), (), fields) if fields else gettext(text)


def say_count(one: str, many: str, /, n: int, **fields: object) -> str:
    """Return the text for the number `n`, which both have as a field: `say_count("{n} file", "{n} files", 3)`."""
    return _FILLS.vformat(ngettext(one, many, n), (), {"n": n, **fields})


def counted(n: int, one: str, many: str = "") -> str:
    """Return a number with its noun, for what is only ever said in English: "1 pair", "2 pairs"."""
    return f"{n} {one if n == 1 else many or f'{one}s'}"


def some(names: Sequence[str], most: int = MOST_SHOWN, between: str = ", ") -> str:
    """Return the first names, and how many more there are: `some(paths, 2)` for "a, b and 3 more"."""
    rest = say(" and {n} more", n=len(names) - most) if len(names) > most else ""
    return between.join(names[:most]) + rest


def mark(text: str) -> str:
    """Return a text as it is; it is in the catalogue, and is said later."""
    return text


def install(environment: Environment) -> None:
    """Let the templates of an environment with jinja2's i18n extension speak the language in use."""
    environment.install_gettext_callables(gettext, ngettext, newstyle=True)  # type: ignore[attr-defined]


def localized(number: str) -> str:
    """Return a number that is written with a point as the language in use writes it."""
    return number.replace(".", _spoken.point)


class _Fills(Formatter):
    def format_field(self, value: Any, format_spec: str) -> str:
        text = format(value, format_spec)
        return localized(text) if isinstance(value, float) else text


_FILLS = _Fills()


@cache
def _read(code: str, course: Path) -> _Language:
    if code == ENGLISH:
        return _Language(code, _gettext.NullTranslations(), ".")
    from babel.messages.mofile import write_mo  # 0.1 s: only where it is needed
    from babel.messages.pofile import read_po
    from babel.numbers import get_decimal_symbol

    whole = _gettext.NullTranslations()
    for path in (LOCALE / code / "LC_MESSAGES" / "grader.po", course / "words" / f"{code}.po"):
        if path.is_file():
            compiled = io.BytesIO()
            with path.open("rb") as stream:
                write_mo(compiled, read_po(stream, locale=code))
            compiled.seek(0)
            whole.add_fallback(_gettext.GNUTranslations(compiled))
    return _Language(code, whole, get_decimal_symbol(code))
