"""gradebook.csv: one line for each person, with every requirement."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from grader.classroom.exports import cells
from grader.classroom.exports.cells import Cell
from grader.classroom.gradebook import Gradebook, Row

_PERSON = ("id", "name", "email", "login", "team")


def write(book: Gradebook, path: Path, *, key: Path | None = None) -> None:
    """Write the gradebook; with `key` without names, which are in that second file then."""
    names = {row.person.key: f"p{number:03}" for number, row in enumerate(book.rows, 1)}
    cells.write(path, _lines(book, names if key else None))
    if key is not None:
        people = ((names[row.person.key], row.submission, *_who(row)) for row in book.rows)
        cells.write(key, [("anonymous", "submission", *_PERSON), *people])


def _lines(book: Gradebook, names: dict[str, str] | None) -> Iterator[Sequence[Cell]]:
    who = ("anonymous",) if names else (*_PERSON, "submission")
    ids = [requirement.id for requirement in book.rubric.requirements]
    yield (*who, "state", "submitted", "late", *ids, "reached", "deduction", "total", "max", "flags", "comment")
    for row in book.rows:
        points = {each.id: each.points for each in row.requirements}
        yield (
            *((names[row.person.key],) if names else (*_who(row), row.submission)),
            row.state.value,
            row.submitted.isoformat(timespec="seconds") if row.submitted else "",
            row.late_units,
            *(points.get(name) for name in ids),
            row.reached,
            row.deduction,
            row.total,
            row.max,
            row.flags,
            "" if names else row.comment,
        )


def _who(row: Row) -> tuple[str, ...]:
    return tuple(getattr(row.person, field) for field in _PERSON)
