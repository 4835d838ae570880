"""Canvas: the CSV that its gradebook imports (instructure/canvas-lms, lib/gradebook_importer.rb)."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from grader.classroom import cells, platform
from grader.classroom.gradebook import Row, State
from grader.classroom.identity import SHORT, Claim
from grader.classroom.platform import Delivery, Export, HandIn, Platform
from grader.errors import GraderError, UsageError

_NUMBERED = re.compile(r"(?P<title>.*)\s\((?P<id>\d+)\)", re.DOTALL)
# lib/content_zipper.rb: the sortable name in lower case, LATE, the user's number or that of an anonymous submission,
# the attachment's number and its name; only what is no word character is taken out of the first three.
_FILE = r"_(?:(?P<file_id>\d+)_(?P<file>.+)|(?:text|link)\.html)"
_NUMBERS = re.compile(r"_(?P<late>LATE_|late_)?(?P<id>\d+)" + _FILE, re.DOTALL)
_ANONYMOUS = re.compile(r"(?P<late>LATE_)?(?P<id>anon_[0-9A-Za-z]+)" + _FILE, re.DOTALL)
_Reading = tuple[str, str]
"""A person's name and number."""


def _write(delivery: Delivery) -> list[str]:
    """Fill in the column of an assignment in a gradebook that Canvas exported; all else stays, byte for byte."""
    book, path, sheet = delivery.book, delivery.sheet, cells.Sheet(delivery.sheet)
    header = sheet.header
    if "Student" not in header[0] or "ID" not in header[1:2]:
        raise GraderError(f"{path} is not a gradebook of Canvas: its first columns are not Student and ID.")
    column = _column(path, header, delivery.title)
    for most in (row[column].strip() for row in sheet.rows if "Points Possible" in row[0]):
        if most and not platform.same_number(most, str(book.max)):
            raise GraderError(
                f"{header[column]} has {most} points in Canvas, the rubric {book.max}. "
                "Set the assignment's points in Canvas and export once more."
            )
    people = [_claims(dict(zip(header, row, strict=False))) for row in sheet.rows]
    _, notes = platform.fill(book, sheet, people, 0, column, _score)
    sheet.write(delivery.out)
    return notes


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


def _claims(named: dict[str, str]) -> list[Claim] | None:
    """Return what a line of the sheet says of a student, in the order in which Canvas itself looks."""
    first = next(iter(named.values())).strip()
    if first in ("", "Student, Test") or "Points Possible" in first:
        return None
    kinds = {"ID": "lms_id", "SIS User ID": "id", "SIS Login ID": "login", "Student": "name"}
    return [
        Claim(kind, value, "canvas" if kind == "lms_id" else "")
        for column, kind in kinds.items()
        if (value := named.get(column, "").strip())
    ]


def _score(row: Row) -> str:
    """Return the score as Canvas reads it: empty for none."""
    return "EX" if row.state is State.EXCUSED else "" if row.total is None or not row.final else str(row.total)


def _read(_root: Path, entries: Sequence[Path]) -> Export:
    """`doejane_12345_6789_team.zip`, `doejane_LATE_12345_6789_team-1.zip`: later attachments have larger numbers.

    A text or a link that was handed in is `doejane_12345_text.html` or `..._link.html`. Without names, as in anonymous
    grading, it is `anon_X3dF9_6789_team.zip` and `LATE_anon_X3dF9_6789_team.zip`.
    """
    read = {entry: found for entry in entries if (found := _readings(entry.name))}
    hand_ins, notes = platform.others([entry for entry in entries if entry not in read])
    people: dict[tuple[_Reading, ...], list[tuple[re.Match[str], Path]]] = {}
    for entry, found in read.items():
        lengths = {len(other[0]["file_id"] or "") for path, other in read.items() if path != entry}
        # Canvas's numbers of files come from one count, so they have about as many digits.
        near = (not lengths or any(n and abs(len(o["file_id"] or "") - n) <= 1 for n in lengths) for o in found[1:])
        likely = [found[0], *(each for each, is_near in zip(found[1:], near, strict=True) if is_near)]
        who = tuple((each.string[: each.start()], each["id"]) for each in likely)
        people.setdefault(who, []).append((found[0], entry))
    for ((name, number), *more), parts in people.items():
        parts.sort(key=lambda part: int(part[0]["file_id"] or 0))
        label = name or number
        path, remarks = platform.one_of(label, [entry for _, entry in parts])
        notes += remarks
        late = any(found["late"] for found, entry in parts if path.is_relative_to(entry))
        hand_ins.append(
            HandIn(path, label, (_said(name, number),), late=late, others=tuple(_said(*who) for who in more))
        )
    return Export("canvas", tuple(hand_ins), tuple(notes))


def _readings(name: str) -> list[re.Match[str]]:
    """Return how the name of an entry can be read, one for each number of a person; the name itself is before it.

    People choose their names and those of their files, and both may look like numbers of Canvas.
    """
    if found := _ANONYMOUS.fullmatch(name):
        return [found]
    readings: dict[str, re.Match[str]] = {}
    for at, char in enumerate(name):
        if char == "_" and (found := _NUMBERS.fullmatch(name, at)):
            readings.setdefault(found["id"], found)
    return list(readings.values())


def _said(name: str, number: str) -> tuple[Claim, ...]:
    claims = [Claim("lms_id", number, "canvas")] if number.isdecimal() else []
    return (*claims, *([Claim(SHORT, name), Claim("team", name)] if name else []))


def _recognises(_root: Path, entries: Sequence[Path]) -> bool:
    """Return whether most of what may be a submission is named as Canvas names it."""
    odd = [entry for entry in entries if not _readings(entry.name)]
    return len(entries) - len(odd) > sum(entry.is_dir() or platform.is_archive(entry) for entry in odd)


PLATFORM = Platform(
    "canvas", "canvas", "canvas.csv", _recognises, _read, _write, fills="the gradebook, by Grades, Export"
)
