"""No platform: archives and folders named after people, and gradebook.csv with a line for each person."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from grader.classroom import cells
from grader.classroom.cells import Cell
from grader.classroom.gradebook import Gradebook
from grader.classroom.platform import Delivery, Export, Platform, others

PERSON = ("id", "name", "email", "login", "team")


def write(book: Gradebook, path: Path) -> None:
    """Write the gradebook: a line for each person, a column for each requirement."""
    graded = ("grade",) if book.rubric.scale else ()
    ids = [requirement.id for requirement in book.rubric.requirements]
    header = (
        *PERSON, "submission", "state", "submitted", "late", *ids, "reached", "deduction", "total", *graded, "max",
        "flags", "kit", "confinement", "comment",
    )  # fmt: skip
    rows: list[Sequence[Cell]] = [header]
    for row in book.rows:
        points = {each.id: "withheld" if each.withheld else each.points for each in row.requirements}
        rows.append((
            *(getattr(row.person, field) for field in PERSON), row.submission, row.state.value,
            row.submitted.isoformat(timespec="seconds") if row.submitted else "", row.late_days,
            *(points.get(name) for name in ids), row.reached, row.deduction, row.total,
            *((row.grade,) if graded else ()), row.max, row.flags, row.kit, row.confinement, row.comment,
        ))  # fmt: skip
    cells.write(path, rows)


def _read(_root: Path, entries: Sequence[Path]) -> Export:
    """Archives and folders, each named after a team or a person."""
    hand_ins, notes = others(entries)
    return Export("plain", tuple(hand_ins), tuple(notes))


def _deliver(delivery: Delivery) -> list[str]:
    write(delivery.book, delivery.out)
    return []


PLATFORM = Platform("csv", "plain", "gradebook.csv", lambda _root, _entries: True, _read, _deliver)
