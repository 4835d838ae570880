"""A class of some fifty people and hand-ins of hostile normality, as each platform exports it.

File names follow the platforms' own sources: Moodle's mod/assign (downloader and clean_filename), Canvas's
lib/content_zipper.rb and lib/gradebook_exporter.rb, Gradescope's submission_metadata.yml, `gh classroom clone`.
What is handed in holds a token, so that a test knows whose it is without asking the code under test.
"""

from __future__ import annotations

import csv
import datetime as dt
import io
import os
import re
import stat
import subprocess
import unicodedata
import warnings
import zipfile
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

DEADLINE = dt.datetime(2026, 11, 20, 23, 59, tzinfo=dt.UTC)
LATE_RULE = "10 % per started day, at most 3 days"
LATE = dt.timedelta(hours=30)
GROUP_NUMBER = {"Team 7": "30024", "Team Ω": "5512"}  # 30024 is also the number of the participant Bo Ek


@dataclass(frozen=True)
class Student:
    """One of the class. `how` says what is handed in, `late` by how much, `ids` replaces ids made of the number."""

    n: int
    given: str
    family: str
    how: str = "package"
    team: str = ""
    late: dt.timedelta = dt.timedelta(hours=-2)
    own_id: str = ""
    own_login: str = ""

    @property
    def id(self) -> str:
        return self.own_id or f"s{1000 + self.n}"

    @property
    def login(self) -> str:
        return self.own_login or f"u{self.n}"

    @property
    def email(self) -> str:
        return f"p{self.n}@uni.example"

    @property
    def canvas(self) -> str:
        return str(20000 + self.n)

    @property
    def moodle(self) -> str:
        return str(30000 + self.n)

    @property
    def name(self) -> str:
        return f"{self.given} {self.family}".strip()

    @property
    def sortable(self) -> str:
        return f"{self.family}, {self.given}" if self.given and self.family else self.name

    @property
    def submitted(self) -> dt.datetime:
        return DEADLINE + self.late


_NAMES: tuple[tuple[str, str], ...] = (
    ("小明", "王"), ("小龍", "李"), ("小龍", "李"), ("Иван", "Петров"), ("Пётр", "Иванов"),
    ("محمد", "علي"), ("فاطمة", "الزهراء"), ("José", "García"), ("José", "Núñez"), ("Zoë", "Müller"),
    ("Li", "Wu"), ("Li", "Wu"), ("Li", "Wu"), ("Jane", "Doe"), ("Jane", "Doe"),
    ("Sean", "O'Brien"), ("Sean", "OBrien"), ("Chloé", "D\u2019Arcy"), ("John", "Smith, Jr."),
    ("Anne-Marie", "Lefèvre-Dupont"), ("Sukarno", ""), ("=Eve", "+Sum"), ("Dr. Max", "Mustermann"),
    ("Bo", "Ek"), ("Tomáš", "Novák"), ("Nguyễn Văn", "An"), ("Åsa", "Öberg"), ("İpek", "Şahin"),
    ("Jörg", "Weiß"), ("Jörg", "Weiss"), ("Wuan", "Li"), ("An", "Liwu"), ("Late", ""), ("Tim", "Under_Score"),
)  # fmt: skip
_SPECIAL = {
    11: {"own_id": "20014"},  # Canvas's number of Jane Doe
    12: {"own_id": "30015"},  # Moodle's number of the other Jane Doe
    24: {"how": "twice"},
    25: {"how": "twice", "late": LATE},
    32: {"late": LATE},
}
ABSENT, UNKNOWN, ANONYMOUS = "nothing", "unknown", "anonymous"
CLASS: tuple[Student, ...] = (
    *(Student(n, given, family, **_SPECIAL.get(n, {})) for n, (given, family) in enumerate(_NAMES, 1)),  # type: ignore[arg-type]
    Student(35, "Uma", "Link", "link"),
    Student(36, "Vic", "Text", "text"),
    Student(37, "Wen", "Both", "text and package"),
    Student(38, "Eve", "Adams", "package", "Team 7", LATE),
    Student(39, "Finn", "Adams", ABSENT, "Team 7"),  # has an extension
    Student(40, "Gil", "Adams", ABSENT, "Team 7"),  # is excused
    Student(41, "Hana", "Satō", "package", "Team Ω"),
    Student(42, "Ivo", "Satō", ABSENT, "Team Ω"),
    Student(43, "Kim", "Swap", own_login="s1001"),  # the id of the first
    Student(44, "Ida", "Twin"),
    Student(45, "Ida", "Twin", ABSENT),
    Student(46, "Nil", "Nada", ABSENT),
    Student(47, "Zed", "Unknown", UNKNOWN),  # not on any roster
    Student(48, "", "", ANONYMOUS),
)
ROSTER = tuple(who for who in CLASS if who.how not in (UNKNOWN, ANONYMOUS))
HANDED_IN = tuple(who for who in CLASS if who.how != ABSENT)


def token(who: Student, old: bool = False) -> str:
    """Return what is written into a submission, `old` into one that was replaced."""
    return f"token-{who.n}{'-old' if old else ''}."


def package(text: str) -> bytes:
    """Return a zip with a package that holds a token."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        archive.writestr("ros2_robot_controller/package.xml", f"<package><description>{text}</description></package>")
    return stream.getvalue()


def _write(path: Path, content: bytes | str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content.encode() if isinstance(content, str) else content)


def _html(who: Student) -> str:
    return f"<html><body>see https://git.example/{who.n}</body></html>"


# Moodle


def _clean_filename(name: str) -> str:
    name = re.sub(r"[\x00-\x1f\x7f&<>\"`|':\\/]", "", name.replace("_", " "))
    return re.sub(r"\.\.+", "", name)


def moodle_name(who: Student) -> str:
    """Return what Moodle calls somebody in file names; one of the class was unpacked on a Mac."""
    name = "Participant" if who.how == ANONYMOUS else _clean_filename(who.name)
    return unicodedata.normalize("NFD", name) if who.n == 9 else name


def moodle(root: Path, separator: str = "/", groups: bool = False) -> None:
    """Moodle since 4.0: a folder for each participant. In Moodle 3 folders' names end in "_"; there may be none.

    In Moodle 3 an assignment for groups has the group before the name.
    """

    def prefix(who: Student) -> str:
        return f"{_group(who)}-" * groups + f"{moodle_name(who)}_{who.moodle}"

    _moodle(root, prefix, separator)


def _moodle(root: Path, prefix: Callable[[Student], str], separator: str) -> None:
    for who in HANDED_IN:
        file, text = (f"{prefix(who)}_assignsubmission_{kind}{separator}" for kind in ("file", "onlinetext"))
        if who.how in ("text", "link", "text and package"):
            _write(root / f"{text}onlinetext.html", _html(who))
        if who.how == "twice":
            _write(root / f"{file}robot.zip", package(token(who, old=True)))
            _write(root / f"{file}robot_v2.zip", package(token(who)))
        elif who.how not in ("text", "link"):
            _write(root / f"{file}robot.zip", package(token(who)))


def moodle_groups(root: Path) -> None:
    """Moodle since 4.0, an assignment for groups: a folder for each group."""
    _moodle(root, lambda who: f"{_group(who)}_{GROUP_NUMBER.get(who.team, str(6000 + who.n))}", "/")


def _group(who: Student) -> str:
    return who.team or f"Single {who.n}"


_WORKSHEET = {
    "en": ("Identifier", "Full name", "ID number", "Email address", "Status", "Group", "Grade", "Maximum grade",
           "Grade can be changed", "Last modified (submission)", "Last modified (grade)", "Feedback comments"),
    "de": ("ID", "Vollständiger Name", "ID-Nummer", "E-Mail-Adresse", "Status", "Gruppe", "Bewertung", "Bestwertung",
           "Bewertung kann geändert werden", "Zuletzt geändert (Abgabe)", "Zuletzt geändert (Bewertung)",
           "Feedback als Kommentar"),
}  # fmt: skip
_DAYS = ("Montag", "Dienstag", "Mittwoch", "Donnerstag", "Freitag", "Samstag", "Sonntag")
COMMENT = 'Well done, "Jane"; see me.'


def worksheet(path: Path, language: str = "en", groups: bool = False, people: Iterable[Student] = ROSTER) -> None:
    """Write Moodle's offline grading worksheet: from Moodle, or as a German spreadsheet saves it."""
    rows: list[tuple[str, ...]] = [_WORKSHEET[language]]
    for who in people:
        local = who.submitted.astimezone()
        when = (
            f"{local:%A}, {local.day} {local:%B %Y}, {local:%I:%M %p}"
            if language == "en"
            else f"{_DAYS[local.weekday()]}, {local.day}. {local:%B %Y}, {local:%H:%M}"
        )
        handed_in = who.how != ABSENT or (groups and who.team)
        participant = f"Participant {who.moodle}" if language == "en" else f"Teilnehmer/in{who.moodle}"
        rows.append(
            (
                participant, who.name, who.id, who.email,
                "Submitted for grading - " if handed_in else "No submission - ",
                _group(who) if groups else "", "", "100.00" if language == "en" else "100,00",
                "Yes" if language == "en" else "Ja", when if handed_in else "-", "-",
                COMMENT if who.n == 14 else "",
            )
        )  # fmt: skip
    drop = () if groups else (5,)
    _sheet(
        path,
        ([cell for place, cell in enumerate(row) if place not in drop] for row in rows),
        "," if language == "en" else ";",
        "\n" if language == "en" else "\r\n",
    )


def _sheet(path: Path, rows: Iterable[Iterable[str]], separator: str, line_end: str) -> None:
    stream = io.StringIO()
    csv.writer(stream, delimiter=separator, lineterminator=line_end).writerows(rows)
    path.write_bytes(b"\xef\xbb\xbf" + stream.getvalue().encode())


# A class of 30 as Moodle exports it, of which the archive's entries are hard to keep


THIRTY = tuple(Student(n, f"Given{n}", f"Family{n}") for n in range(101, 131))
GONE = {101: "..", 102: "link", 103: "absolute", 104: "twice", 105: "not there"}
LONG = {106: "a" * 260 + ".zip", 107: "\u0440\u043e\u0431\u043e\u0442 " * 21 + ".zip"}
"""What entries are called that no file system takes; 271 bytes and more."""


def lossy(folder: Path) -> None:
    """Write `export.zip` and `worksheet.csv`: of 30 who handed in, five have entries that cannot be unpacked."""
    folder.mkdir(exist_ok=True)
    with zipfile.ZipFile(folder / "export.zip", "w") as archive, warnings.catch_warnings():
        warnings.simplefilter("ignore")  # by zipfile, for duplicate names
        for who in THIRTY:
            place = f"{moodle_name(who)}_{who.moodle}_assignsubmission_file"
            match GONE.get(who.n):
                case None:
                    archive.writestr(f"{place}/{LONG.get(who.n, 'robot.zip')}", package(token(who)))
                case "..":
                    archive.writestr(f"{place}/..\\robot.zip", package(token(who)))
                case "link":
                    link = zipfile.ZipInfo(place)
                    link.external_attr = (stat.S_IFLNK | 0o777) << 16
                    archive.writestr(link, "/media/usb/robot")
                case "absolute":
                    archive.writestr(f"/{place}/robot.zip", package(token(who)))
                case "twice":
                    archive.writestr(f"{place}/robot.zip", package("of another"))
                    archive.writestr(f"{place}/robot.zip", package(token(who)))
    worksheet(folder / "worksheet.csv", people=THIRTY)


# Canvas


def canvas_name(who: Student) -> str:
    """Return what Canvas calls somebody in file names."""
    return _words(who.sortable)


def _words(text: str) -> str:
    """Return what Ruby's [[:word:]] leaves of a name in lower case: marks of letters too, unlike Python's \\w."""
    return "".join(
        each for each in text.lower() if unicodedata.category(each)[0] in "LM" or each.isdigit() or each == "_"
    )


def canvas(root: Path) -> None:
    """Canvas: every file in one folder; a group's file has the group's name and one member's number."""
    for who in HANDED_IN:
        number = f"anon_x{who.n}Kq" if who.how == ANONYMOUS else who.canvas
        name = "" if who.how == ANONYMOUS else _words(who.team) or canvas_name(who)
        late = "LATE" if who.late == LATE else ""
        start = "_".join(filter(None, (name, late, number)))
        attachment = 90000 + who.n
        if who.how in ("text", "link", "text and package"):
            _write(root / f"{start}_{'link' if who.how == 'link' else 'text'}.html", _html(who))
        if who.how == "twice":
            _write(root / f"{start}_9{who.n}_robot.zip", package(token(who, old=True)))  # 9.. sorts behind 1..
            _write(root / f"{start}_100{who.n}_robot-1.zip", package(token(who)))
        elif who.how not in ("text", "link"):
            odd = "my_1234_5678_robot.zip" if who.n == 14 else "robot.zip"
            _write(root / f"{start}_{attachment}_{odd}", package(token(who)))


TEST_STUDENT = "29999"


def canvas_gradebook(path: Path, separator: str = ",") -> None:
    """Write the gradebook that Canvas exports, with a row for hidden grades and its Test Student."""
    header = ["Student", "ID", "SIS User ID", "SIS Login ID", "Section", "Quiz (70)", "Robots (77)", "Current Score"]
    decimal = "," if separator == ";" else "."
    rows = [
        header,
        ["", "", "", "", "", "", "Manual Posting", ""],
        ["    Points Possible", "", "", "", "", f"10{decimal}00", f"100{decimal}00", "(read only)"],
        *(
            [f'="{who.sortable}"' if who.sortable.startswith("=") else who.sortable, who.canvas, who.id, who.login,
             "A and B", f"9{decimal}50", "", f"95{decimal}00"]
            for who in sorted(ROSTER, key=lambda who: who.sortable)
        ),
        ["Student, Test", TEST_STUDENT, "", "c0ffee", "A", "", "", ""],
    ]  # fmt: skip
    _sheet(path, rows, separator, "\n")


# Gradescope


def gradescope(root: Path) -> None:
    """Gradescope: a folder for each submission, and who and when in submission_metadata.yml."""
    lines = ["---"]
    for who in HANDED_IN:
        members = [each for each in CLASS if who.team and each.team == who.team] or [who]
        for number, old in ((5000 + who.n, who.how == "twice"), (4000 + who.n, False))[who.how != "twice" :]:
            folder = root / f"submission_{number}"
            if who.how in ("text", "link"):
                _write(folder / "answer.html", _html(who))
            else:
                with zipfile.ZipFile(io.BytesIO(package(token(who, old)))) as archive:
                    archive.extractall(folder)
            lines.append(f"submission_{number}:\n  :submitters:")
            for each in members:
                sid = each.id if each.n not in (13, 25) else ""
                email = "" if each.n == 13 else each.email.upper() if each.n == 25 else each.email
                name = "" if who.how == ANONYMOUS else each.name.replace("'", "''")
                lines.append(f"  - :name: '{name}'\n    :sid: '{sid}'\n    :email: '{email}'")
            if who.how == ANONYMOUS:
                lines[-1:] = []
                lines[-1] = lines[-1].replace(":submitters:", ":submitters: []")
            when = who.submitted - dt.timedelta(hours=50) if old else who.submitted
            lines.append(f"  :created_at: {when:%Y-%m-%d %H:%M:%S}.861687000 Z\n  :score: 0.0\n  :status: processed")
    _write(root / "submission_metadata.yml", "\n".join(lines) + "\n")


# GitHub Classroom


def github(root: Path) -> None:
    """GitHub Classroom: clones named after the assignment and a login, or a team."""
    for who in HANDED_IN:
        login = "ghost-x" if who.how == ANONYMOUS else who.team.lower().replace(" ", "-").replace("ω", "omega")
        folder = root / f"robots-{login or who.login}"
        for old in (True, False) if who.how == "twice" else (False,):
            if who.how in ("text", "link"):
                _write(folder / "README.md", _html(who))
            else:
                _write(folder / "ros2_robot_controller" / "package.xml", token(who, old))
            when = (who.submitted - dt.timedelta(hours=50 if old else 0)).isoformat()
            dates = {"GIT_AUTHOR_DATE": when, "GIT_COMMITTER_DATE": when}
            if not (folder / ".git").exists():
                _git(folder, dates, "init", "-q")
            _git(folder, dates, "add", "-A")
            _git(folder, dates, "-c", "user.name=x", "-c", "user.email=x@x", "commit", "-q", "-m", "work")


def _git(folder: Path, dates: dict[str, str], *arguments: str) -> None:
    subprocess.run(["git", *arguments], cwd=folder, check=True, env={**os.environ, **dates})


def github_roster(path: Path) -> None:
    """Write GitHub Classroom's roster; one who handed in is not linked, and so are those who did not."""
    rows = [
        [who.id if who.n % 2 else who.email, "" if who.how == ABSENT or who.n == 20 else who.login,
         "" if who.how == ABSENT or who.n == 20 else str(80000 + who.n), ""]
        for who in ROSTER
    ]  # fmt: skip
    stream = io.StringIO()
    csv.writer(stream, quoting=csv.QUOTE_ALL, lineterminator="\n").writerows(
        [["identifier", "github_username", "github_id", "name"], *rows]
    )
    path.write_text(stream.getvalue())


def roster(path: Path, groups: bool = False) -> None:
    """Write a university's own list: semicolons, a byte order mark, CRLF, first and last names; NFD where Moodle has
    NFC, and without the title."""
    rows = [("id", "First name", "Last name", "email", "login", "team")]
    for who in ROSTER:
        form: Literal["NFC", "NFD"] = "NFD" if who.n == 10 else "NFC"
        given, family = (unicodedata.normalize(form, part) for part in (who.given, who.family))
        team = _group(who) if groups else who.team
        rows.append((who.id, given.removeprefix("Dr. "), family, who.email, who.login, team))
    _sheet(path, rows, ";", "\r\n")
