"""Canvas: the CSV that its gradebook imports (instructure/canvas-lms, lib/gradebook_importer.rb)."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from grader.classroom import cells
from grader.classroom.cells import Cell
from grader.classroom.gradebook import Gradebook, Row, State
from grader.classroom.identity import SHORT, Claim
from grader.classroom.platform import Delivery, Export, HandIn, Platform, is_archive, one_of, others, rows_of
from grader.classroom.roster import Person
from grader.errors import GraderError

_NUMBERED = re.compile(r"(?P<title>.*)\s\((?P<id>\d+)\)", re.DOTALL)
# lib/content_zipper.rb: the sortable name in lower case, LATE, the user's number or that of an anonymous submission,
# the attachment's number and its name; only what is no word character is taken out of the first three.
_ENTRY = re.compile(
    r"(?:(?P<name>.*?)_(?P<late>LATE_|late_)?(?P<id>\d+)|(?P<late_unknown>LATE_)?(?P<unknown>anon_[0-9A-Za-z]+))_"
    r"(?:(?P<file_id>\d+)_(?P<file>.+)|(?:text|link)\.html)",
    re.DOTALL,
)
_HEADER = ("Student", "ID", "SIS User ID", "SIS Login ID", "Section")


def write(book: Gradebook, path: Path, title: str) -> None:
    """Write a file for an assignment; `title` is "Robots (77)", with Canvas's own number of it.

    Without the number Canvas looks for an assignment of just this title, and makes a new one if there is none.
    """
    rows: list[Sequence[Cell]] = [(*_HEADER, title), ("    Points Possible", "", "", "", "", book.max)]
    rows += [
        (
            _sortable(row.person),
            _number(row),
            row.person.id,
            row.person.login,
            "",
            _score(row),
        )
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
    people = [_claims(dict(zip(header, cell_row, strict=False))) for cell_row in rows[1:]]
    for cell_row, found in zip(rows[1:], rows_of(book, people), strict=True):
        cell_row += [""] * (len(header) - len(cell_row))
        if "Points Possible" in cell_row[0]:
            if cell_row[column].strip() and float(cell_row[column]) != float(book.max):
                raise GraderError(
                    f"{header[column]} has {cell_row[column]} points in Canvas, the rubric {book.max}. "
                    "Set the assignment's points in Canvas and export once more."
                )
        elif cell_row[0].strip() not in ("", "Student, Test"):
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


def _claims(named: dict[str, str]) -> list[Claim]:
    """Return what a line of the sheet says of a student, in the order in which Canvas itself looks."""
    kinds = {"ID": "lms_id", "SIS User ID": "id", "SIS Login ID": "login", "Student": "name"}
    return [
        Claim(kind, value, "canvas" if kind == "lms_id" else "")
        for column, kind in kinds.items()
        if (value := named.get(column, "").strip())
    ]


def _number(row: Row) -> str:
    """Return Canvas's number of a person; what Moodle calls a participant is another one's number in Canvas."""
    return row.person.lms_id if row.person.lms == "canvas" else ""


def _sortable(person: Person) -> str:
    first, _, last = person.name.rpartition(" ")
    return person.sortable or (f"{last}, {first}" if first else person.name)


def _score(row: Row) -> Cell:
    return "EX" if row.state is State.EXCUSED else row.total if row.total is not None else ""


def _read(_root: Path, entries: Sequence[Path]) -> Export:
    """`doejane_12345_6789_team.zip`, `doejane_LATE_12345_6789_team-1.zip`: later attachments have larger numbers.

    A text or a link that was handed in is `doejane_12345_text.html` or `..._link.html`. Without names, as in anonymous
    grading, it is `anon_X3dF9_6789_team.zip` and `LATE_anon_X3dF9_6789_team.zip`.
    """
    people: dict[str, list[tuple[re.Match[str], Path]]] = {}
    odd = []
    for entry in entries:
        if found := _ENTRY.fullmatch(entry.name):
            people.setdefault(found["id"] or found["unknown"], []).append((found, entry))
        else:
            odd.append(entry)
    hand_ins, notes = others(odd)
    for number, parts in people.items():
        parts.sort(key=lambda part: int(part[0]["file_id"] or 0))
        path, remarks = one_of([entry for _, entry in parts])
        late = any(found["late"] or found["late_unknown"] for found, entry in parts if entry == path)
        name = parts[-1][0]["name"] or ""
        label = name or number
        notes += [f"{label}: {remark}" for remark in remarks]
        claims = [Claim("lms_id", number, "canvas")] if number.isdecimal() else []
        claims += [Claim(SHORT, name), Claim("team", name)] if name else []
        hand_ins.append(HandIn(path, label, (tuple(claims),), late=late))
    return Export("canvas", tuple(hand_ins), tuple(notes))


def _recognises(_root: Path, entries: Sequence[Path]) -> bool:
    """Return whether most of what may be a submission is named as Canvas names it."""
    named = [bool(_ENTRY.fullmatch(entry.name)) for entry in entries if _may_be_submission(entry)]
    return 2 * sum(named) > len(named)


def _may_be_submission(entry: Path) -> bool:
    return entry.is_dir() or is_archive(entry) or bool(_ENTRY.fullmatch(entry.name))


def _deliver(delivery: Delivery) -> list[str]:
    if delivery.sheet:
        return cells.unknown(fill(delivery.book, delivery.sheet, delivery.out, delivery.title))
    write(delivery.book, delivery.out, delivery.title or delivery.book.rubric.title)
    return []


PLATFORM = Platform("canvas", "canvas", "canvas.csv", _recognises, _read, _deliver)
