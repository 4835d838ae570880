"""One submission of a class."""

from __future__ import annotations

import datetime as dt
from dataclasses import dataclass
from pathlib import Path

from grader.classroom.identity import Claim
from grader.classroom.roster import Person


@dataclass(frozen=True)
class Entry:
    """One submission of a class.

    Attributes:
        id: its name in the class folder and in overrides.yaml: lower case letters, digits and hyphens.
        label: how the export calls it.
        number: the platform's own number for it or for who handed it in, "" if it gives none.
        path: the archive or folder.
        content: the SHA-256 of what was handed in, packed as it was.
        people: who handed it in, with all their team; empty if it is not certain.
        submitted: when, None if that is not known.
        matched: by what each of `people` was matched, in their order: what the export says of them, "team" for a
            member beside whom another one was matched, or "overrides" for a person's decision.
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
    matched: tuple[Claim, ...] = ()
    source: str = ""
    absent: bool = False
