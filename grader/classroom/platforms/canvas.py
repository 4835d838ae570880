"""Canvas: the CSV that its gradebook imports (instructure/canvas-lms, lib/gradebook_importer.rb)."""

from __future__ import annotations

import io
import re
import zipfile
from collections.abc import Sequence
from functools import partial
from pathlib import Path

from grader.classroom import cells
from grader.classroom.cells import Cell
from grader.classroom.gradebook import Row, State
from grader.classroom.identity import SHORT, Claim
from grader.classroom.platform import (
    Delivery,
    Export,
    Filled,
    HandIn,
    Platform,
    deliver,
    is_archive,
    one_of,
    others,
    rows_of,
    same_number,
)
from grader.classroom.roster import Person
from grader.errors import GraderError, UsageError

_NUMBERED = re.compile(r"(?P<title>.*)\s\((?P<id>\d+)\)", re.DOTALL)
# lib/content_zipper.rb: the sortable name in lower case, LATE, the user's number or that of an anonymous submission,
# the attachment's number and its name; only what is no word character is taken out of the first three.
_ENTRY = re.compile(
    r"(?:(?P<name>.*?)_(?P<late>LATE_|late_)?(?P<id>\d+)|(?P<late_unknown>LATE_)?(?P<unknown>anon_[0-9A-Za-z]+))_"
    r"(?:(?P<file_id>\d+)_(?P<file>.+)|(?:text|link)\.html)",
    re.DOTALL,
)
_HEADER = ("Student", "ID", "SIS User ID", "SIS Login ID", "Section")


def write(delivery: Delivery) -> list[str]:
    """Write a file for an assignment; its title is "Robots (77)", with Canvas's own number of it.

    Without the number Canvas looks for an assignment of just this title, and makes a new one if there is none.
    """
    book, title = delivery.book, delivery.title or delivery.book.rubric.title
    rows: list[Sequence[Cell]] = [(*_HEADER, title), ("    Points Possible", "", "", "", "", book.max)]
    rows += [(_sortable(r.person), _number(r), r.person.id, r.person.login, "", _score(r)) for r in book.rows]
    cells.write(delivery.out, rows)
    return []


def fill(delivery: Delivery, path: Path) -> list[str]:
    """Fill in the column of an assignment in a gradebook that Canvas exported; all else stays, byte for byte.

    Raises:
        GraderError: it is not such a file, has no such column, or the points possible differ.
    """
    book, sheet = delivery.book, cells.Sheet(path)
    header = sheet.header
    if "Student" not in header[0] or "ID" not in header[1:2]:
        raise GraderError(f"{path} is not a gradebook of Canvas: its first columns are not Student and ID.")
    column = _column(path, header, delivery.title)
    filled = Filled()
    people = [_claims(dict(zip(header, row, strict=False))) for row in sheet.rows]
    for number, (row, found) in enumerate(zip(sheet.rows, rows_of(book, people), strict=True)):
        if "Points Possible" in row[0]:
            if row[column].strip() and not same_number(row[column], str(book.max)):
                raise GraderError(
                    f"{header[column]} has {row[column]} points in Canvas, the rubric {book.max}. "
                    "Set the assignment's points in Canvas and export once more."
                )
        elif row[0].strip() not in ("", "Student, Test"):
            cell = filled.cell(found, row[0], row[column], _score(found) if found else "")
            if cell is not None:
                sheet.set(number, column, cell)
    sheet.write(delivery.out)
    return filled.notes()


def _column(sheet: Path, header: Sequence[str], title: str) -> int:
    assignments = {
        index: found["title"] for index, name in enumerate(header) if (found := _NUMBERED.fullmatch(name.strip()))
    }
    fits = [i for i, name in assignments.items() if not title or title in (name, header[i].strip())]
    if len(fits) != 1:
        names = ", ".join(header[index] for index in assignments) or "none"
        raise UsageError(
            f"{sheet} has several assignments, or not the one that is named: {names}.", "Add --assignment."
        )
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


def _score(row: Row) -> str:
    """Return the score as Canvas reads it: empty for none."""
    return "EX" if row.state is State.EXCUSED else "" if row.total is None or not row.final else str(row.total)


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


def _feedback(delivery: Delivery) -> tuple[dict[str, bytes], list[str]]:
    """Return the files of the zip for "Upload submissions".

    Canvas attaches each file as a comment, under the attachment's own name. It looks for the numbers of the person and
    of the attachment in a file's name, and shows it to the whole group.
    """
    files, without = {}, []
    for submission, page in delivery.pages.items():
        found = _ENTRY.fullmatch(delivery.sources.get(submission, ""))
        if found is None or not found["file_id"] or not found["file"].lower().endswith(".zip"):
            without.append(submission)
            continue
        inner = io.BytesIO()
        with zipfile.ZipFile(inner, "w", zipfile.ZIP_DEFLATED) as archive:
            archive.write(page, "report.html")
        who = f"student_{found['id']}" if found["id"] else found["unknown"]
        files[f"{who}_{found['file_id']}_report.zip"] = inner.getvalue()
    return files, [f"no zip that Canvas exported, so no feedback file: {', '.join(without)}"] if without else []


_DELIVER = partial(deliver, write=write, fill=fill, feedback=_feedback)
PLATFORM = Platform("canvas", "canvas", "canvas.csv", _recognises, _read, _DELIVER)
