"""All that names a person in text, and how it is found there. Pure."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator

from grader.classroom.roster import IDENTITY, Person

SHORTEST = 3
"""Characters of a name or a number that is looked for; a shorter one is in every text."""


def words(person: Person) -> set[str]:
    """Return what names a person: ids, e-mail, login, and the name in the forms in which files have it."""
    return {value for kind in IDENTITY if len(value := getattr(person, kind)) >= SHORTEST} | set(forms(person.name))


def forms(name: str) -> Iterator[str]:
    """Yield a name as it is, with its last word first, and without what is between its words."""
    first, _, last = name.rpartition(" ")
    turned = [f"{last}, {first}", f"{last} {first}"] if first else []
    squeezed = [re.sub(r"[\W_]+", "", form) for form in (name, *turned)]
    yield from (form for form in (name, *turned, *squeezed) if len(form) >= SHORTEST)


def pattern(wanted: Iterable[str]) -> re.Pattern[str]:
    """Return what finds any of the words, the longest first, whatever the case; in "Doe_12" and "doe-1", too."""
    longest = sorted({re.escape(word) for word in wanted}, key=len, reverse=True)
    return re.compile(rf"(?<![^\W_])(?:{'|'.join(longest) or '(?!)'})(?![^\W_])", re.IGNORECASE)
