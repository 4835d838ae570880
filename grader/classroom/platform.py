"""What a learning platform's module offers: recognise and read its export, and write grades for it.

Each module in `grader/classroom/platforms/` has one `PLATFORM`. Nothing is unpacked or run here. The formats are
described in docs/classes.md.
"""

from __future__ import annotations

import datetime as dt
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path
from typing import Any

from grader.classroom.cells import Sheet
from grader.classroom.gradebook import Gradebook, RequirementPoints, Row, State
from grader.classroom.identity import ANY, Claim, identify
from grader.classroom.roster import Person
from grader.intake.containers import ARCHIVE_SUFFIXES
from grader.intake.names import natural
from grader.sanitize import prose
from grader.scoring.rubric import FLAGS, Rubric
from grader.words import counted

_CLOSED = (".rar", ".7z", ".gz", ".xz", ".bz2", ".zst")
_SEEN = 160  # characters of what was seen, in a short comment
_SYSTEM_FILES = frozenset({"__MACOSX", "Thumbs.db", "desktop.ini"})


@dataclass(frozen=True)
class HandIn:
    """One submission as the export has it.

    Attributes:
        path: the archive or the folder.
        label: a short name for people.
        claims: what the export says about who handed it in, the surest first; one tuple for each person.
        submitted: when, None if the export does not say.
        late: whether the export marks it as late.
        others: what the export says if the name of the entry is read in other ways, for one person each.
    """

    path: Path
    label: str
    claims: tuple[tuple[Claim, ...], ...] = ()
    submitted: dt.datetime | None = None
    late: bool = False
    others: tuple[tuple[Claim, ...], ...] = ()


@dataclass(frozen=True)
class Lost:
    """What an export has, or lists, and no submission has.

    Attributes:
        label: whose it is, or what it is called.
        what: a sentence.
        claims: as for HandIn.
        sure: it is a hand-in or a part of one; otherwise only its name may be that of a person.
    """

    label: str
    what: str
    claims: tuple[tuple[Claim, ...], ...]
    sure: bool = True


@dataclass(frozen=True)
class Export:
    """What a folder holds.

    Attributes:
        layout: the name of its layout.
        hand_ins: the submissions.
        notes: a remark on each entry that is none.
        lost: what is no submission, or not a whole one, though it may be somebody's.
        ledger: how the entries add up: submissions, files beside them, and what was left out.
    """

    layout: str
    hand_ins: tuple[HandIn, ...]
    notes: tuple[str, ...] = ()
    lost: tuple[Lost, ...] = ()
    ledger: str = ""


@dataclass(frozen=True)
class Delivery:
    """Grades to be written for a platform.

    Attributes:
        book: everyone's line.
        reports: each submission's report.json by its id, empty where it could not be graded.
        out: the file or folder to write.
        sheet: the file to be filled in, where the platform wants one of its own.
        title: the assignment's title on the platform, "" if it was not said.
    """

    book: Gradebook
    reports: Mapping[str, dict[str, Any]]
    out: Path
    sheet: Path = Path()
    title: str = ""


def same_number(one: str, other: str) -> bool:
    """Return whether two cells hold the same number, or the same text."""
    try:
        return Decimal(one.strip().replace(",", ".")) == Decimal(other.strip().replace(",", "."))
    except ArithmeticError:
        return one.strip() == other.strip()


@dataclass(frozen=True)
class Platform:
    """One learning platform.

    Attributes:
        name: what `--for` calls it.
        layout: what class.yaml calls the layout of its export.
        out: the name of the file or folder that is written for it.
        recognises: whether a folder with these entries is its export.
        read: the submissions in that folder.
        write: write the grades, and return remarks for the instructor.
        own: the names of files that the platform itself adds to its export.
        fills: the file of its own that it wants filled in, "" if it wants none.
    """

    name: str
    layout: str
    out: str
    recognises: Callable[[Path, Sequence[Path]], bool]
    read: Callable[[Path, Sequence[Path]], Export]
    write: Callable[[Delivery], list[str]]
    own: tuple[str, ...] = ()
    fills: str = ""


def is_archive(path: Path) -> bool:
    """Return whether a file is an archive by its name, also one of a kind that will be refused."""
    return path.is_file() and path.name.lower().endswith((*ARCHIVE_SUFFIXES, *_CLOSED))


def entries_of(root: Path) -> list[Path]:
    """Return what is in a folder, v9 before v10, without what file systems leave there."""
    found = (each for each in root.iterdir() if each.name not in _SYSTEM_FILES and not each.name.startswith("."))
    return sorted(found, key=lambda each: natural(each.name))


def inside(folder: Path) -> list[Path]:
    """Return the same of a folder in an export, nothing for a file and where it cannot be read."""
    try:
        return entries_of(folder)
    except OSError:
        return []


def has(folder: Path, name: str) -> bool:
    """Return whether there is such an entry in a folder; not where it cannot be read."""
    try:
        return (folder / name).exists()
    except OSError:
        return False


def stem(path: Path) -> str:
    """Return the name of an archive without its suffix, or of a folder."""
    return without_suffix(path.name) if path.is_file() else path.name


def without_suffix(name: str) -> str:
    """Return a name without the suffix of an archive."""
    suffixes = sorted((*ARCHIVE_SUFFIXES, *_CLOSED), key=len, reverse=True)
    return name[: -len(next((suffix for suffix in suffixes if name.lower().endswith(suffix)), "")) or None]


def named(name: str) -> tuple[tuple[Claim, ...], ...]:
    """Return the claims of a submission whose file name is all that is known: any field of a person, or a team."""
    return ((Claim(ANY, name), Claim("team", name)),)


def others(entries: Iterable[Path]) -> tuple[list[HandIn], list[str]]:
    """Return entries that are named as no platform names them: archives and folders by their names, and remarks."""
    found, notes = [], []
    for entry in entries:
        if entry.is_dir() or is_archive(entry):
            found.append(HandIn(entry, stem(entry), named(stem(entry))))
        else:
            notes.append(f"{entry.name} is neither an archive nor a folder; it was left out.")
    return found, notes


def unfolded(paths: Sequence[Path]) -> list[Path]:
    """Return the paths; a folder that has nothing but files, one of them an archive, stands for its files."""
    found = []
    for path in paths:
        children = inside(path)
        found += children if all(each.is_file() for each in children) and any(map(is_archive, children)) else [path]
    return found


def one_of(label: str, entries: Sequence[Path]) -> tuple[Path, list[str]]:
    """Return which of somebody's entries is graded, the last archive or else the last folder; a remark on the others.

    They are in the order in which they were handed in, where a platform says that, or else as `entries_of` has them.
    """
    paths = unfolded(entries)
    ranked = sorted(paths, key=lambda path: (is_archive(path), path.is_dir()))
    chosen = ranked[-1]
    others = [path.name for path in paths if path != chosen]
    return chosen, [f"{label}: {chosen.name} is graded, the last one, not {', '.join(others)}."] if others else []


def fill(
    book: Gradebook, sheet: Sheet, people: Sequence[Sequence[Claim] | None], name: int, column: int,
    grade: Callable[[Row], str],
) -> tuple[dict[int, Row], list[str]]:  # fmt: skip
    """Set the grades in a `column` of a sheet; return whose each line is that has one now, and remarks.

    `people` are what the sheet says of the person of each line, None for a line that is nobody's. The lines of whoever
    is not known or not final, and grades that a person gave, stay.
    """
    filled: dict[int, Row] = {}
    unknown, waiting, kept, replaced = list[str](), list[str](), list[str](), list[str]()
    for number, (line, who, row) in enumerate(zip(sheet.rows, people, rows_of(book, people), strict=True)):
        called, before = line[name], line[column].strip()
        held = before not in ("", "-")
        if who is None:
            continue
        if row is None:
            unknown.append(called)
        elif not row.final:
            waiting.append(f"{called} ({row.state.value})")
        else:
            after = grade(row) or line[column]  # Moodle knows no excuse
            same = same_number(before, after)
            if held and not same and (row.state is State.MISSING or before == "EX"):
                kept.append(f"{called} ({before})")
                continue
            replaced += [f"{called} ({before}, now {after or 'none'})"] * (held and not same)
            sheet.set(number, column, line[column] if same else after)
            filled[number] = row
    said = {
        "not known to the gradebook; their lines stay as they were": unknown,
        "not final yet; their lines stay as they were": waiting,
        "graded or excused in the sheet by a person, which stays": kept,
        "had another grade in the sheet": replaced,
    }
    return filled, [f"{words}: {', '.join(names)}" for words, names in said.items() if names]


def rows_of(book: Gradebook, people: Sequence[Sequence[Claim] | None]) -> list[Row | None]:
    """Return the row of each person of a sheet by what the sheet says of them, None for whom that is not certain.

    A row that fits two people of the sheet is that of neither.
    """
    rows: dict[Person, list[Row]] = {}
    for row in book.rows:
        rows.setdefault(row.person, []).append(row)
    found = [identify(claims or (), list(rows)).people for claims in people]
    sure = [one[0] if len(one) == 1 and len(rows[one[0]]) == 1 and found.count(one) == 1 else None for one in found]
    return [rows[person][0] if person is not None else None for person in sure]


def by_requirement(report: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Return what a report.json says of each requirement, nothing of what could not be graded."""
    return {each["id"]: each for each in report.get("requirements", ())}


def losses(requirement: dict[str, Any]) -> Iterator[str]:
    """Return what was seen, expected and what to try, for each check of a requirement that did not pass."""
    for check in requirement.get("checks", ()):
        if check["outcome"] == "passed":
            continue
        yield f"{check['sentence'] or check['id']}: {check['outcome'].replace('_', ' ')}"
        for name in ("seen", "expected", "try", "because"):
            for number, line in enumerate(str(check.get(name) or "").splitlines()):
                yield f"  {'' if number else name:<9} {line}"


def judged(
    row: Row, rubric: Rubric, report: Mapping[str, Any]
) -> list[tuple[RequirementPoints, str, list[str]]]:  # fmt: skip
    """Return for each requirement of a row its points, what it is called, and what its checks say of what was lost."""
    measured = by_requirement(report)
    return [
        (each, f"{each.id} {rubric.requirement(each.id).title}", list(losses(measured.get(each.id, {}))))
        for each in row.requirements
    ]


def comment(row: Row, rubric: Rubric, before: str = "") -> str:
    """Return a comment for a platform without a person behind it: it says what integrity flags do, if there are any."""
    do = "withhold points until a person decides" if rubric.withholds else "take no points by themselves"
    flags = f"{counted(row.flags, 'integrity flag', 'integrity flags')} (flags: {FLAGS[rubric.withholds]}): they {do}"
    return "; ".join(filter(None, [before, row.comment, flags if row.flags else ""]))


def short(row: Row, report: Mapping[str, Any]) -> list[str]:
    """Return a short comment: the total, what people decided, the first cause, and what was seen where points went."""
    lines = [f"{row.total} of {row.max} points" if row.final and row.total is not None else "no grade"]
    lines += [prose(row.comment)] if row.comment else []
    cause = report.get("cause", {})
    if cause.get("sentence"):
        lines.append(f"First cause: {prose(cause['sentence'], _SEEN)} ({cause['points']:g} points)")
    measured = by_requirement(report)
    unreached = []
    for each in row.requirements:
        if each.lost <= 0:
            continue
        said = measured.get(each.id, {})
        if said.get("outcome") == "not_reached" and not each.override:
            unreached.append(each)
        else:
            seen = "" if each.override else prose(str(said.get("seen", "")), _SEEN)
            lines.append(f"{each.id}: {f'{seen}, ' if seen else ''}{each.lost} of {each.max} points lost")
    if unreached:
        lost = sum(each.max for each in unreached)
        lines.append(f"not reached: {', '.join(each.id for each in unreached)}, {lost} points lost")
    return lines
