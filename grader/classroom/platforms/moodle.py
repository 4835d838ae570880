"""Moodle: the offline grading worksheet of an assignment, filled in.

Format: moodle, mod/assign/feedback/offline/importgradeslib.php.
"""

from __future__ import annotations

import html
import re
from collections.abc import Mapping, Sequence
from pathlib import Path

from grader.classroom import cells, platform, roster
from grader.classroom.gradebook import Row
from grader.classroom.identity import Claim, key
from grader.classroom.platform import Delivery, Export, HandIn, Platform
from grader.errors import GraderError

_PLUGIN = re.compile(r"_assignsubmission_(?P<kind>[a-z]+)_?(?P<file>.*)", re.DOTALL)
_WHO = re.compile(r"(?P<name>.+?)(?:_(?P<id>\d+))?", re.DOTALL)
_BEGIN = "[Automatic grading: "
_OURS = re.compile(re.escape(_BEGIN) + r"[^\]]*\]")
_ROUND = str.maketrans("[]", "()")  # inside our brackets


def _write(delivery: Delivery) -> list[str]:
    """Fill in the grades and comments of an offline grading worksheet; all else stays, byte for byte.

    A comment that a person wrote is kept, and ours follows it in brackets, or replaces the one that is there.
    """
    book, sheet = delivery.book, cells.Sheet(delivery.sheet)
    columns = roster.worksheet_columns(sheet.header)
    if columns is None or "grade" not in columns:
        raise GraderError(
            f"{delivery.sheet} is not an offline grading worksheet: it lacks the columns Identifier and Grade. "
            "Download it in English."
        )
    for most in (row[columns["maximum"]].strip() for row in sheet.rows if "maximum" in columns):
        if most and not platform.same_number(most, str(book.max)):
            raise GraderError(
                f"The assignment's maximum grade in Moodle is {most}, the rubric has {book.max} points. "
                "Set the maximum in Moodle and download the worksheet once more."
            )
    said = [{what: row[place].strip() for what, place in columns.items()} for row in sheet.rows]
    people = [_claims(line) if any(line.values()) else None for line in said]
    name = columns.get("name", columns["identifier"])

    def grade(row: Row) -> str:  # Moodle skips one above the maximum, so a bonus ends there
        return "" if row.total is None else str(min(row.total, book.max))

    filled, notes = platform.fill(book, sheet, people, name, columns["grade"], grade)
    for number, row in filled.items():
        if place := columns.get("feedback"):
            sheet.set(number, place, _appended(sheet.rows[number][place], _comment(row, delivery)))
    sheet.write(delivery.out)
    over = [row.person.label for row in book.rows if row.final and row.total is not None and row.total > book.max]
    notes += [f"more than the maximum, which is all that Moodle takes: {', '.join(over)}"] if over else []
    return notes


def _claims(said: Mapping[str, str]) -> list[Claim]:
    """Return what a line of the sheet says of a participant."""
    number = roster.participant_number(said["identifier"])
    claims = [Claim("lms_id", number, "moodle")] if number else []
    return claims + [Claim(kind, said[kind]) for kind in ("id", "email", "name") if said.get(kind)]


def _comment(row: Row, delivery: Delivery) -> str:
    """Return the comment, which Moodle takes for HTML."""
    said = [html.escape(line, quote=False) for line in platform.short(row, delivery.reports.get(row.submission, {}))]
    return f"{_BEGIN}{'<br>'.join(said).translate(_ROUND)}]" if said else ""


def _appended(before: str, comment: str) -> str:
    """Return a comment with ours in it once, in its old place or at the end."""
    first, *rest = _OURS.split(before)
    return first + comment + "".join(rest) if rest else "<br>".join(filter(None, [before, comment]))


def _read(_root: Path, entries: Sequence[Path]) -> Export:
    """`Jane Doe_12345_assignsubmission_file_/...`, or the same in front of each file's name.

    In place of the name and the participant's number there may be a group's name and number, `Default group` alone,
    or (before Moodle 4.1) a group's name, a hyphen and a participant; and `Participant` where names are hidden.
    """
    read = {entry: found for entry in entries if (found := _readings(entry))}
    hand_ins, notes = platform.others([entry for entry in entries if entry not in read])
    people: dict[tuple[tuple[str, str], ...], list[tuple[str, Path]]] = {}
    for entry, found in read.items():
        people.setdefault(tuple(who for who, _ in found), []).append((found[0][1], entry))
    for ((name, number), *more), parts in people.items():
        parts.sort(key=lambda part: part[0] == "file")  # a text that was typed beside files counts less
        label = f"{name} {number}" if _is_hidden(name) else name
        path, remarks = platform.one_of(label, [entry for _, entry in parts])
        notes += remarks
        hand_ins.append(HandIn(path, label, (_said(name, number),), others=tuple(_said(*who) for who in more)))
    return Export("moodle", tuple(hand_ins), tuple(notes))


def _readings(entry: Path) -> list[tuple[tuple[str, str], str]]:
    """Return how the name of an entry can be read: name and number of a person, and the kind of the hand-in.

    People choose their names and those of their files. A folder's name has no file in it, so its end is Moodle's.
    """
    found = []
    for place in re.finditer("_assignsubmission_", entry.name):
        after, who = _PLUGIN.fullmatch(entry.name, place.start()), _WHO.fullmatch(entry.name[: place.start()])
        if after and who and not (entry.is_dir() and "_assignsubmission_" in after["file"]):
            found.append(((who["name"], who["id"] or ""), after["kind"]))
    return found


def _is_hidden(name: str) -> bool:
    return key(name) in map(key, roster.PARTICIPANTS)


def _said(name: str, number: str) -> tuple[Claim, ...]:
    claims = [Claim("lms_id", number, "moodle")] if number else []
    return (*claims, *([] if _is_hidden(name) else [Claim("name", name), Claim("team", name)]))


PLATFORM = Platform(
    "moodle", "moodle", "moodle.csv", lambda _root, entries: any(map(_readings, entries)), _read, _write,
    fills="the assignment's grading worksheet, by Download grading worksheet",
)  # fmt: skip
