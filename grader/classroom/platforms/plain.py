"""No platform: archives and folders named after people, and gradebook.csv with a line for each person."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from grader.classroom import cells
from grader.classroom.cells import Cell
from grader.classroom.gradebook import Gradebook, Row
from grader.classroom.platform import Delivery, Export, Platform, others

_PERSON = ("id", "name", "email", "login", "team")


def write(book: Gradebook, path: Path, *, key: Path | None = None) -> None:
    """Write the gradebook; with `key` without names, which are in that second file then."""
    cells.write(path, _lines(book, anonymous=key is not None))
    if key is not None:
        people = ((_alias(number), row.submission, *_who(row)) for number, row in enumerate(book.rows, 1))
        cells.write(key, [("anonymous", "submission", *_PERSON), *people])


def _alias(number: int) -> str:
    return f"p{number:03}"


def _lines(book: Gradebook, anonymous: bool) -> Iterator[Sequence[Cell]]:
    who = ("anonymous",) if anonymous else (*_PERSON, "submission")
    graded = ("grade",) if book.rubric.scale else ()
    ids = [requirement.id for requirement in book.rubric.requirements]
    yield (
        *who,
        "state",
        "submitted",
        "late",
        *ids,
        "reached",
        "deduction",
        "total",
        *graded,
        "max",
        "flags",
        "kit",
        "comment",
    )
    for number, row in enumerate(book.rows, 1):
        points = {each.id: each.points for each in row.requirements}
        yield (
            *((_alias(number),) if anonymous else (*_who(row), row.submission)),
            row.state.value,
            row.submitted.isoformat(timespec="seconds") if row.submitted else "",
            row.late_units,
            *(points.get(name) for name in ids),
            row.reached,
            row.deduction,
            row.total,
            *((row.grade,) if graded else ()),
            row.max,
            row.flags,
            row.kit,
            "" if anonymous else row.comment,
        )


def _who(row: Row) -> tuple[str, ...]:
    return tuple(getattr(row.person, field) for field in _PERSON)


def _read(_root: Path, entries: Sequence[Path]) -> Export:
    """Archives and folders, each named after a team or a person."""
    hand_ins, notes = others(entries)
    return Export("plain", tuple(hand_ins), tuple(notes))


def _deliver(delivery: Delivery) -> list[str]:
    key = delivery.out.with_name(f"{delivery.out.stem}_key.csv") if delivery.anonymous else None
    write(delivery.book, delivery.out, key=key)
    return [f"{key} says who is who."] if key else []


PLATFORM = Platform("csv", "plain", "gradebook.csv", lambda _root, _entries: True, _read, _deliver)
