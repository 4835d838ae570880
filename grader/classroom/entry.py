"""One submission of a class."""

from __future__ import annotations

import datetime as dt
from dataclasses import dataclass
from pathlib import Path

from grader.classroom.roster import Person


@dataclass(frozen=True)
class MatchedBy:
    """By what a person was matched with a submission: a field of Person, and what the export says of it.

    `kind` is "short name" for a file name of Canvas's, "overrides" for what a person assigned, and "team" for a
    member who is there because another one, or the team itself, was matched.
    """

    kind: str
    value: str

    @property
    def means(self) -> str:
        """Return the kind in words, such as "e-mail"."""
        return _KINDS.get(self.kind, self.kind)

    @property
    def text(self) -> str:
        """Return it for people, such as "e-mail jane@uni.edu"."""
        return f"{self.means} {self.value}"


_KINDS = {"lms_id": "the platform's number", "email": "e-mail"}


@dataclass(frozen=True)
class Entry:
    """One submission of a class.

    Attributes:
        id: its name in the class folder and in overrides.yaml: lower case letters, digits and hyphens.
        label: how the export calls it.
        number: the platform's own number for it or for who handed it in, "" if it gives none.
        path: the archive or folder.
        content: the SHA-256 of what was handed in, packed as it was.
        people: who handed it in, with all their team; empty if nobody of the roster fits.
        submitted: when, None if that is not known.
        matched: by what each of `people` was matched, in their order.
        late: whether the export marks it as late.
        notes: remarks for the instructor.
        source: the folder or archive in which it was found, as it was given.
        absent: an earlier run found it, and the present sources do not have it. What was graded stays.
    """

    id: str
    label: str
    path: Path
    content: str
    people: tuple[Person, ...] = ()
    submitted: dt.datetime | None = None
    late: bool = False
    notes: tuple[str, ...] = ()
    number: str = ""
    matched: tuple[MatchedBy, ...] = ()
    source: str = ""
    absent: bool = False
