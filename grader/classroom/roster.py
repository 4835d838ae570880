"""Read roster.csv: who is in the class. Columns are found by their names, so exports of Canvas and Moodle serve too."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields
from pathlib import Path

from grader.errors import GraderError

# Our columns, and how the exports of Canvas, Moodle, Gradescope and GitHub Classroom call them. All in lower case.
_ALIASES: Mapping[str, tuple[str, ...]] = {
    "id": ("student id", "sis user id", "id number", "idnumber", "sid", "student_id"),
    "name": ("full name", "student", "student name"),
    "email": ("e-mail", "email address", "mail"),
    "login": ("sis login id", "username", "user name", "github_username", "github", "github username"),
    "team": ("group", "group name", "team name", "group_name"),
    "lms_id": ("identifier", "canvas id", "canvas user id", "participant"),
}
IDENTITY = ("id", "lms_id", "login", "email")
"""The fields of a person that no two people share, the surest first."""
_FIRST_NAMES, _LAST_NAMES = ("first name", "firstname", "given name"), ("last name", "surname", "lastname")


@dataclass(frozen=True)
class Person:
    """One student. What the roster does not say is "". `lms_id` is the number that Canvas or Moodle give in exports."""

    id: str = ""
    name: str = ""
    email: str = ""
    login: str = ""
    team: str = ""
    lms_id: str = ""

    @property
    def key(self) -> tuple[str, str]:
        """Return what tells the person from all others: a field and its value. A name only if nothing else is known."""
        kind = next((kind for kind in IDENTITY if getattr(self, kind)), "name")
        return kind, getattr(self, kind).casefold()

    @property
    def label(self) -> str:
        """Return what the person is called in tables: the name, else what identifies them."""
        return self.name or next((value for kind in IDENTITY if (value := getattr(self, kind))), "")


def load(path: Path) -> tuple[Person, ...]:
    """Return the people in the CSV file `path`, in its order.

    Raises:
        GraderError: it cannot be read, has no usable column, or lists somebody twice; the message names the line.
    """
    try:
        text = path.read_bytes().decode("utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise GraderError(f"The roster {path} cannot be read ({error}). Save it as CSV in UTF-8.") from error
    rows = csv.reader(io.StringIO(text, newline=""), delimiter=delimiter(text))
    header = [cell.strip() for cell in next(rows, [])]
    columns = _columns(header)
    if not set(columns) & {"id", "name", "email", "login"}:
        raise GraderError(
            f"The roster {path} has no column that names a person. "
            f"Its first line needs some of: {', '.join(field.name for field in fields(Person))}."
        )
    people: list[Person] = []
    lines: dict[tuple[str, str], int] = {}
    for row in rows:
        person = _person(row, columns)
        if person is None:
            continue
        for kind, value in (person.key, *((kind, getattr(person, kind).casefold()) for kind in IDENTITY)):
            if value and (first := lines.setdefault((kind, value), rows.line_num)) != rows.line_num:
                raise GraderError(
                    f"{path}, line {rows.line_num}: the {kind} {value} is in line {first} too. Keep one line for each "
                    "person; an id, a login or an email tells people of one name apart."
                )
        people.append(person)
    return tuple(people)


def delimiter(text: str) -> str:
    """Return what separates the columns: spreadsheets of some countries write semicolons or tabs."""
    first = text.partition("\n")[0]
    return max(",;\t", key=first.count)


def _columns(header: list[str]) -> dict[str, list[int]]:
    """Return the positions of our columns; a name may be in two, first and last."""
    lowered = [name.casefold() for name in header]
    found: dict[str, list[int]] = {}
    for field, aliases in _ALIASES.items():
        for name in (field, *aliases):
            if name in lowered:
                found[field] = [lowered.index(name)]
                break
    if "sis user id" in lowered and "id" in lowered:  # Canvas: "ID" is its own number
        found["id"], found["lms_id"] = [lowered.index("sis user id")], [lowered.index("id")]
    if "name" not in found:
        parts = [next((lowered.index(n) for n in names if n in lowered), None) for names in (_FIRST_NAMES, _LAST_NAMES)]
        if found_parts := [part for part in parts if part is not None]:
            found["name"] = found_parts
    return found


def _person(row: list[str], columns: Mapping[str, list[int]]) -> Person | None:
    """Return the person of a line, None for an empty line and for Canvas's line of possible points."""
    values = {field: " ".join(_cells(row, places)) for field, places in columns.items()}
    if not any(values.values()) or values.get("name", "").startswith("Points Possible"):
        return None
    if "," in values.get("name", ""):  # "Doe, Jane"
        last, _, first = values["name"].partition(",")
        values["name"] = f"{first.strip()} {last.strip()}"
    values["lms_id"] = values.get("lms_id", "").removeprefix("Participant").strip()
    return Person(**values)


def _cells(row: list[str], places: list[int]) -> Iterator[str]:
    return (row[place].strip() for place in places if place < len(row) and row[place].strip())
