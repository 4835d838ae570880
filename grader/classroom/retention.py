"""Which submissions of earlier runs stay in a class although no export has them any more. Pure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from grader.classroom.entry import Entry
from grader.classroom.roster import Person


def retained(earlier: Sequence[Entry], present: Sequence[Entry], roster: Sequence[Person]) -> tuple[Entry, ...]:
    """Return the `earlier` entries that are neither `present` nor replaced by other hand-ins of the same people.

    A later export is often partial: of one group, or of the late ones only. Whoever handed in earlier keeps the grade.
    """
    known = {(entry.label, entry.number) for entry in present}
    handed_in = {person.key for entry in present for person in entry.people}
    of_roster = {person.key: person for person in roster}
    stay = []
    for entry in earlier:
        matched = dict(zip(entry.people, entry.matched, strict=False))
        people = tuple(person for person in entry.people if person.key not in handed_in)
        if (entry.label, entry.number) not in known and (people or not entry.people):
            stay.append(
                replace(
                    entry,
                    people=tuple(of_roster.get(person.key, person) for person in people),
                    matched=tuple(matched[person] for person in people if person in matched),
                    absent=True,
                )
            )
    return tuple(stay)
