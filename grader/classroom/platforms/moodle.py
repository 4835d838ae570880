"""Moodle: a CSV for its grade import, or the offline grading worksheet of an assignment, filled in.

Formats: moodle, grade/import/csv/classes/load_data.php and mod/assign/feedback/offline/importgradeslib.php.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from grader.classroom import cells
from grader.classroom.cells import Cell
from grader.classroom.gradebook import Gradebook, Row
from grader.classroom.identity import Claim, key
from grader.classroom.platform import Delivery, Export, HandIn, Platform, one_of, others, rows_of, unfolded
from grader.classroom.worksheet import PARTICIPANTS, participant
from grader.errors import GraderError

# Moodle matches a person by the column that the teacher chooses; a locked or empty one is no error.
_IDENTITY = (("idnumber", "id"), ("email", "email"), ("username", "login"))
_ENTRY = re.compile(r"(?P<name>.+?)(?:_(?P<id>\d+))?_assignsubmission_(?P<kind>[a-z]+)_?(?P<file>.*)", re.DOTALL)
_GRADE, _FEEDBACK, _MAXIMUM = "Grade", "Feedback comments", "Maximum Grade"


def write(book: Gradebook, path: Path, title: str) -> None:
    """Write a file for Grades > Import > CSV; people without any identity Moodle knows are left out."""
    rows: list[Sequence[Cell]] = [(*(name for name, _ in _IDENTITY), title, f"Feedback: {title}")]
    rows += [
        (*(getattr(row.person, field) for _, field in _IDENTITY), _grade(row), row.comment)
        for row in book.rows
        if any(getattr(row.person, field) for _, field in _IDENTITY)
    ]
    cells.write(path, rows)


def fill(book: Gradebook, sheet: Path, path: Path) -> list[str]:
    """Fill in the grades and comments of an offline grading worksheet; all other cells stay.

    Returns:
        the participants of the sheet whom the gradebook does not know.

    Raises:
        GraderError: it is not such a file, or its maximum is not the rubric's.
    """
    rows, separator = cells.read(sheet)
    header = rows[0]
    if _GRADE not in header or "Identifier" not in header:
        raise GraderError(
            f"{sheet} is not an offline grading worksheet: it lacks the columns Identifier and Grade. "
            "Download it in English, or use --for moodle without a sheet."
        )
    unknown = []
    people = [_claims(dict(zip(header, cell_row, strict=False))) for cell_row in rows[1:]]
    for cell_row, found in zip(rows[1:], rows_of(book, people), strict=True):
        cell_row += [""] * (len(header) - len(cell_row))
        named = dict(zip(header, cell_row, strict=True))
        maximum = named.get(_MAXIMUM, "").strip()
        if maximum and float(maximum.replace(",", ".")) != float(book.max):
            raise GraderError(
                f"The assignment's maximum grade in Moodle is {maximum}, the rubric has {book.max} points. "
                "Set the maximum in Moodle and download the worksheet once more."
            )
        if found is None:
            unknown.append(named.get("Full name") or named["Identifier"])
            continue
        cell_row[header.index(_GRADE)] = _grade(found)
        if _FEEDBACK in header:
            cell_row[header.index(_FEEDBACK)] = cells.neutral(found.comment)
    cells.write_as_read(path, rows, separator)
    return unknown


def _claims(named: dict[str, str]) -> list[Claim]:
    """Return what a line of the sheet says of a participant."""
    kinds = {"Identifier": "lms_id", "ID number": "id", "Email address": "email", "Full name": "name"}
    return [
        Claim(kind, participant(value) if kind == "lms_id" else value, "moodle" if kind == "lms_id" else "")
        for column, kind in kinds.items()
        if (value := named.get(column, "").strip())
    ]


def _grade(row: Row) -> str:
    """Return the grade as Moodle reads it: empty for none, and "-" would be none too."""
    return "" if row.total is None else str(row.total)


def _read(_root: Path, entries: Sequence[Path]) -> Export:
    """`Jane Doe_12345_assignsubmission_file_/...`, or the same in front of each file's name.

    In place of the name and the participant's number there may be a group's name and number, `Default group` alone,
    or (before Moodle 4.1) a group's name, a hyphen and a participant; and `Participant` where names are hidden.
    """
    people: dict[str, list[tuple[re.Match[str], Path]]] = {}
    odd = []
    for entry in entries:
        if found := _ENTRY.fullmatch(entry.name):
            people.setdefault(found["id"] or found["name"], []).append((found, entry))
        else:
            odd.append(entry)
    hand_ins, notes = others(odd)
    for parts in people.values():
        files = [entry for found, entry in parts if found["kind"] == "file"] or [entry for _, entry in parts]
        path, remarks = one_of(unfolded(files))
        name, number = parts[0][0]["name"], parts[0][0]["id"] or ""
        hidden = key(name) in map(key, PARTICIPANTS)
        label = f"{name} {number}" if hidden else name
        notes += [f"{label}: {remark}" for remark in remarks]
        claims = [Claim("lms_id", number, "moodle")] if number else []
        claims += [] if hidden else [Claim("name", name), Claim("team", name)]
        hand_ins.append(HandIn(path, label, (tuple(claims),)))
    return Export("moodle", tuple(hand_ins), tuple(notes))


def _recognises(_root: Path, entries: Sequence[Path]) -> bool:
    return any(_ENTRY.fullmatch(entry.name) for entry in entries)


def _deliver(delivery: Delivery) -> list[str]:
    if delivery.sheet:
        return cells.unknown(fill(delivery.book, delivery.sheet, delivery.out))
    write(delivery.book, delivery.out, delivery.title or delivery.book.rubric.title)
    return []


PLATFORM = Platform("moodle", "moodle", "moodle.csv", _recognises, _read, _deliver)
