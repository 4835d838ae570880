"""Moodle: a CSV for its grade import, or the offline grading worksheet of an assignment, filled in.

Formats: moodle, grade/import/csv/classes/load_data.php and mod/assign/feedback/offline/importgradeslib.php.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from grader.classroom.exports import cells
from grader.classroom.exports.cells import Cell
from grader.classroom.gradebook import Gradebook, Row
from grader.errors import GraderError

# Moodle matches a person by the column that the teacher chooses; a locked or empty one is no error.
_IDENTITY = (("idnumber", "id"), ("email", "email"), ("username", "login"))
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
    for cell_row in rows[1:]:
        cell_row += [""] * (len(header) - len(cell_row))
        named = dict(zip(header, cell_row, strict=True))
        maximum = named.get(_MAXIMUM, "").strip()
        if maximum and float(maximum.replace(",", ".")) != float(book.max):
            raise GraderError(
                f"The assignment's maximum grade in Moodle is {maximum}, the rubric has {book.max} points. "
                "Set the maximum in Moodle and download the worksheet once more."
            )
        found = _find(book, named)
        if found is None:
            unknown.append(named.get("Full name") or named["Identifier"])
            continue
        cell_row[header.index(_GRADE)] = _grade(found)
        if _FEEDBACK in header:
            cell_row[header.index(_FEEDBACK)] = cells.neutral(found.comment)
    cells.write_as_read(path, rows, separator)
    return unknown


def _find(book: Gradebook, named: dict[str, str]) -> Row | None:
    number = named["Identifier"].removeprefix("Participant").strip()
    wanted = (
        ("lms_id", number),
        ("id", named.get("ID number", "")),
        ("email", named.get("Email address", "")),
        ("name", named.get("Full name", "")),
    )
    for field, value in wanted:
        fits = [row for row in book.rows if value and getattr(row.person, field) == value]
        if len(fits) == 1:
            return fits[0]
    return None


def _grade(row: Row) -> str:
    """Return the grade as Moodle reads it: empty for none, and "-" would be none too."""
    return "" if row.total is None else str(row.total)
