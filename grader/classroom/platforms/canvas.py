"""Canvas: the CSV that its gradebook imports (instructure/canvas-lms, lib/gradebook_importer.rb)."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from grader.classroom import cells
from grader.classroom.cells import Cell
from grader.classroom.gradebook import Gradebook, Row, State
from grader.classroom.platform import Claim, Delivery, Export, HandIn, Platform, one_of
from grader.errors import GraderError

_NUMBERED = re.compile(r"(?P<title>.*)\s\((?P<id>\d+)\)", re.DOTALL)
_ENTRY = re.compile(
    r"(?P<name>[^_]+)(?P<late>_late)?_(?P<id>\d+)_(?P<file_id>\d+)_(?P<file>.+)", re.IGNORECASE | re.DOTALL
)
_HEADER = ("Student", "ID", "SIS User ID", "SIS Login ID", "Section")


def write(book: Gradebook, path: Path, title: str) -> None:
    """Write a file for an assignment; `title` is "Robots (77)", with Canvas's own number of it.

    Without the number Canvas looks for an assignment of just this title, and makes a new one if there is none.
    """
    rows: list[Sequence[Cell]] = [(*_HEADER, title), ("    Points Possible", "", "", "", "", book.max)]
    rows += [
        (_sortable(row.person.name), row.person.lms_id, row.person.id, row.person.login, "", _score(row))
        for row in book.rows
    ]
    cells.write(path, rows)


def fill(book: Gradebook, sheet: Path, path: Path, title: str = "") -> list[str]:
    """Fill in the column of the assignment `title` in a gradebook that Canvas exported; all other cells stay.

    Returns:
        the students of the sheet whom the gradebook does not know.

    Raises:
        GraderError: it is not such a file, has no such column, or the points possible differ.
    """
    rows, separator = cells.read(sheet)
    header = rows[0]
    if "Student" not in header[0] or "ID" not in header[1:2]:
        raise GraderError(f"{sheet} is not a gradebook of Canvas: its first columns are not Student and ID.")
    column = _column(sheet, header, title)
    unknown = []
    for cell_row in rows[1:]:
        cell_row += [""] * (len(header) - len(cell_row))
        if "Points Possible" in cell_row[0]:
            if cell_row[column].strip() and float(cell_row[column]) != float(book.max):
                raise GraderError(
                    f"{header[column]} has {cell_row[column]} points in Canvas, the rubric {book.max}. "
                    "Set the assignment's points in Canvas and export once more."
                )
        elif cell_row[0].strip() not in ("", "Student, Test"):
            named = dict(zip(header, cell_row, strict=False))
            found = _find(book, named)
            if found is None:
                unknown.append(cell_row[0])
            else:
                cell_row[column] = str(_score(found))
    cells.write_as_read(path, rows, separator)
    return unknown


def _column(sheet: Path, header: Sequence[str], title: str) -> int:
    assignments = {
        index: found["title"] for index, name in enumerate(header) if (found := _NUMBERED.fullmatch(name.strip()))
    }
    fits = [i for i, name in assignments.items() if not title or title in (name, header[i].strip())]
    if len(fits) != 1:
        names = ", ".join(header[index] for index in assignments) or "none"
        raise GraderError(f"{sheet}: name the assignment with --assignment; the sheet has: {names}.")
    return fits[0]


def _find(book: Gradebook, named: dict[str, str]) -> Row | None:
    """Return the row of a student, looked for as Canvas does: its own number, SIS id, login, name."""
    for column, field in (("ID", "lms_id"), ("SIS User ID", "id"), ("SIS Login ID", "login")):
        if value := named.get(column, "").strip():
            for row in book.rows:
                if getattr(row.person, field) == value:
                    return row
    name = named["Student"].strip()
    fits = [row for row in book.rows if name in (row.person.name, _sortable(row.person.name))]
    return fits[0] if len(fits) == 1 else None


def _sortable(name: str) -> str:
    first, _, last = name.rpartition(" ")
    return f"{last}, {first}" if first else name


def _score(row: Row) -> Cell:
    return "EX" if row.state is State.EXCUSED else row.total if row.total is not None else ""


def _read(_root: Path, entries: Sequence[Path]) -> Export:
    """`doejane_12345_6789_team.zip`, `doejane_LATE_12345_6789_team-1.zip`: later attachments have larger numbers."""
    people: dict[str, list[tuple[re.Match[str], Path]]] = {}
    notes = []
    for entry in entries:
        if found := _ENTRY.fullmatch(entry.name):
            people.setdefault(found["id"], []).append((found, entry))
        else:
            notes.append(f"{entry.name} is not named as Canvas names a submission; it was left out.")
    hand_ins = []
    for number, parts in people.items():
        parts.sort(key=lambda part: int(part[0]["file_id"]))
        path, remarks = one_of([entry for _, entry in parts])
        late = any(found["late"] for found, entry in parts if entry == path)
        name = parts[-1][0]["name"]
        notes += [f"{name}: {remark}" for remark in remarks]
        hand_ins.append(HandIn(path, name, ((Claim("lms_id", number), Claim("joined name", name)),), late=late))
    return Export("canvas", tuple(hand_ins), tuple(notes))


def _recognises(_root: Path, entries: Sequence[Path]) -> bool:
    files = [entry for entry in entries if entry.is_file()]
    return bool(files) and all(_ENTRY.fullmatch(file.name) for file in files)


def _deliver(delivery: Delivery) -> list[str]:
    if delivery.sheet:
        return cells.unknown(fill(delivery.book, delivery.sheet, delivery.out, delivery.title))
    write(delivery.book, delivery.out, delivery.title or delivery.book.rubric.title)
    return []


PLATFORM = Platform("canvas", "canvas", "canvas.csv", _recognises, _read, _deliver)
