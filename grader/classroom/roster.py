"""Read roster.csv: who is in the class. Columns are found by their names.

A gradebook of Canvas, a grading worksheet of Moodle and a roster of GitHub Classroom serve too. Moodle translates the
worksheet's header, the word before a participant's number and the times (mod/assign/gradingtable.php); the words here
are those of the English and German language packs of Moodle 4.5.
"""

from __future__ import annotations

import datetime as dt
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from grader.classroom.cells import Sheet
from grader.errors import GraderError

# The strings recordid, lastmodifiedsubmission and lastmodifiedgrade of mod_assign; the others are of Moodle's core.
_WORDS: Mapping[str, tuple[str, ...]] = {
    "identifier": ("identifier", "id"),
    "name": ("full name", "vollständiger name"),
    "submitted": ("last modified (submission)", "zuletzt geändert (abgabe)"),
    "modified": ("last modified (grade)", "zuletzt geändert (bewertung)"),
    "id": ("id number", "id-nummer", "matrikelnummer"),
    "email": ("email address", "e-mail-adresse"),
    "login": ("username", "anmeldename"),
    "team": ("group", "gruppe"),
    "grade": ("grade", "bewertung"),
    "maximum": ("maximum grade", "bestwertung"),
    "feedback": ("feedback comments", "feedback als kommentar"),
}
# The string submissionstatus_submitted of mod_assign; a state is followed by that of the grading.
HANDED_IN = ("submitted for grading", "zur bewertung abgegeben")
NOT_HANDED_IN = ("no submission", "keine abgabe")  # there may be a time, of a page that was only opened
PARTICIPANTS = ("Participant", "Teilnehmer/in")
"""What a participant is called whose name is hidden (the strings participant and hiddenuser)."""
_PARTICIPANT = re.compile(r"(?P<word>.*\D)\s?(?P<number>\d+)", re.DOTALL)
_MONTHS = (
    {"january", "januar"}, {"february", "februar"}, {"march", "märz"}, {"april"}, {"may", "mai"}, {"june", "juni"},
    {"july", "juli"}, {"august"}, {"september"}, {"october", "oktober"}, {"november"}, {"december", "dezember"},
)  # fmt: skip
_CLOCK = re.compile(r"(?P<hour>\d{1,2})[:.h](?P<minute>\d{2})(?::\d{2})?\s*(?P<half>[ap]\.?\s?m\b)?", re.IGNORECASE)


def worksheet_columns(header: Sequence[str]) -> dict[str, int] | None:
    """Return the places of a worksheet's columns by what they hold, None if the header is not a worksheet's."""
    lowered = [cell.strip().casefold() for cell in header]
    found = {
        what: next(place for place, word in enumerate(lowered) if word in words)
        for what, words in _WORDS.items()
        if not set(words).isdisjoint(lowered)
    }
    trimmed = lowered[0] != "id" and "name" in found
    if found.get("identifier") != 0 or not ("modified" in found or trimmed):
        return None
    if place := next((place for place, word in enumerate(lowered) if word == "status"), None):
        found["status"] = place
    if len(header) > 1 and 1 not in found.values() and lowered[1] != "status":
        found.setdefault("name", 1)  # there is no name where submissions are anonymous
    return found


def participant_number(cell: str) -> str:
    """Return the number of "Participant 12345" or "Teilnehmer/in12345", "" if there is none."""
    found = _PARTICIPANT.fullmatch(cell.strip())
    return found["number"] if found else cell.strip() if cell.strip().isdecimal() else ""


def worksheet_time(text: str) -> dt.datetime | None:
    """Return a time as Moodle writes it for people, in the time zone of this machine; None if it cannot be read."""
    clock = _CLOCK.search(text)
    if clock is None:
        return None
    date = text[: clock.start()] + " " + text[clock.end() :]
    words = {word.casefold() for word in re.findall(r"[^\W\d_]+", date)}
    months = [number for number, names in enumerate(_MONTHS, 1) if names & words]
    numbers = [int(number) for number in re.findall(r"\d+", date)]
    if len(months) != 1 or len(numbers) != 2:
        return None
    hour, half = int(clock["hour"]), (clock["half"] or "").lower()
    hour = hour % 12 + 12 * half.startswith("p") if half else hour
    try:
        return dt.datetime(max(numbers), months[0], min(numbers), hour, int(clock["minute"])).astimezone()
    except ValueError:
        return None


# Our columns, and how the exports of Canvas, Moodle, Gradescope and GitHub Classroom call them. All in lower case.
_ALIASES: Mapping[str, tuple[str, ...]] = {
    "id": ("student id", "sis user id", "id number", "idnumber", "sid", "student_id"),
    "name": ("full name", "student", "student name"),
    "email": ("e-mail", "email address", "mail"),
    "login": ("sis login id", "username", "user name", "github_username", "github", "github username"),
    "team": ("group", "group name", "team name", "group_name"),
    "lms_id": ("canvas id", "canvas user id", "participant"),
    "submitted": ("submitted at", "submitted_at"),
}
IDENTITY = ("id", "lms_id", "login", "email")
"""The fields of a person that no two people share, the surest first."""
_CANVAS = {"id", "sis login id"}  # "SIS User ID" is there only if the teacher may see it
_GITHUB = {"identifier", "github_username"}
_TEST_STUDENT = "Student, Test"  # of Canvas, for teachers who look at their course as a student
_SUFFIX = re.compile(r"(sn?r|jn?r|senior|junior|ii|iii|iv|v|vi|esq|esquire)\.?", re.IGNORECASE)  # as Canvas has them
_FIRST_NAMES, _LAST_NAMES = ("first name", "firstname", "given name"), ("last name", "surname", "lastname")


@dataclass(frozen=True)
class Person:
    """One student. What the roster does not say is "".

    `lms_id` is the number that a platform gives in exports, `lms` that platform: "canvas", "moodle" or "" if that is
    not known. `sortable` is the name as it was, where that is with the last name first: "Doe, Jane".
    """

    id: str = ""
    name: str = ""
    email: str = ""
    login: str = ""
    team: str = ""
    lms_id: str = ""
    lms: str = ""
    sortable: str = ""

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
    people: list[Person] = []
    lines: dict[tuple[str, str], int] = {}
    for line, person, _, _ in rows(path):
        for kind, value in (person.key, *((kind, getattr(person, kind).casefold()) for kind in IDENTITY)):
            if value and (first := lines.setdefault((kind, value), line)) != line:
                raise GraderError(
                    f"{path}, line {line}: the {kind} {value} is in line {first} too. Keep one line for each "
                    "person; an id, a login or an email tells people of one name apart."
                )
        people.append(person)
    return tuple(people)


def rows(path: Path) -> Iterator[tuple[int, Person, str, str]]:
    """Yield for each person of a CSV file the line, the person, and what it says of the hand-in: its time and state.

    Raises:
        GraderError: it cannot be read, or has no usable column.
    """
    sheet = Sheet(path)
    columns, lms = _columns([cell.strip() for cell in sheet.header])
    if not set(columns) & {"id", "name", "email", "login", "lms_id", "identifier"}:
        raise GraderError(
            f"{path} has no column that names a person. Its first line needs some of: {', '.join(_ALIASES)}."
        )
    for line, row in enumerate(sheet.rows, 2):
        said = {field: [row[at].strip() for at in places] for field, places in columns.items()}
        person = _person({field: list(filter(None, cells)) for field, cells in said.items()}, lms)
        if person is not None:
            submitted, status = ("".join(said.get(field, ())) for field in ("submitted", "status"))
            yield line, person, submitted, status


def first_name_first(name: str) -> str:
    """Return "Jane Doe" for "Doe, Jane"; what stands behind a comma may also be a suffix, as in "John Doe, Jr."."""
    last, *others = (part.strip() for part in name.split(","))
    first = [part for part in others if part and not _SUFFIX.fullmatch(part)]
    suffixes = [part for part in others if _SUFFIX.fullmatch(part)]
    return " ".join([*first, last, *suffixes]) if first else name


def _columns(header: list[str]) -> tuple[dict[str, list[int]], str]:
    """Return the positions of our columns, and the platform that gave the numbers of the file, "" if that is not known.

    A name may be in two columns, last and first.
    """
    lowered = [name.casefold() for name in header]
    sheet = worksheet_columns(header)
    if sheet is not None:
        names = {"identifier": "lms_id"}
        found = {names.get(what, what): [place] for what, place in sheet.items()}
        return {what: places for what, places in found.items() if what in (*_ALIASES, "status")}, "moodle"
    found = {}
    for field, aliases in _ALIASES.items():
        if places := [lowered.index(name) for name in (field, *aliases) if name in lowered]:
            found[field] = places[:1]
    lms = "canvas" if {"canvas id", "canvas user id"} & set(lowered) else ""
    if set(lowered) >= _CANVAS:  # "ID" is Canvas's own number
        lms, found["lms_id"] = "canvas", [lowered.index("id")]
        found["id"] = [lowered.index("sis user id")] if "sis user id" in lowered else []
    if set(lowered) >= _GITHUB:
        found["identifier"] = [lowered.index("identifier")]
    parts = [next((lowered.index(n) for n in names if n in lowered), None) for names in (_LAST_NAMES, _FIRST_NAMES)]
    if "name" not in found and any(part is not None for part in parts):
        found["name"] = [part for part in parts if part is not None]
    return found, "moodle" if "participant" in lowered else lms


def _person(said: Mapping[str, list[str]], lms: str) -> Person | None:
    """Return the person of a line, None for an empty line and for Canvas's lines of points and of the test student."""
    values = {field: ", ".join(cells) for field, cells in said.items() if field not in ("submitted", "status")}
    if identifier := values.pop("identifier", ""):  # of GitHub Classroom: whatever the teacher chose
        kind = "email" if "@" in identifier else "id" if any(map(str.isdigit, identifier)) else "name"
        values[kind] = identifier
    name = values.get("name", "").removeprefix('="').removesuffix('"')  # so Canvas writes a name that begins with =
    if not any(values.values()) or name.startswith("Points Possible"):
        return None
    if lms == "canvas" and name == _TEST_STUDENT and not values.get("id"):
        return None
    parts = said.get("name", [])
    turned = f"{parts[1]} {parts[0]}" if len(parts) > 1 else first_name_first(name)  # from last name, first name
    if turned != name:
        values["sortable"] = name
    values["name"] = turned
    if values.get("lms_id"):
        values["lms_id"], values["lms"] = participant_number(values["lms_id"]) or values["lms_id"], lms
    return Person(**values)
