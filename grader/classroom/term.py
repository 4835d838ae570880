"""Add up the classes of a term: term.yaml lists their folders with weights, totals.csv has a line for each person.

    title: Robotics, winter 2026
    roster: roster.csv
    sheets:
      - {class: sheet1/class, weight: 20}
      - {class: sheet2/class, weight: 30, title: Driving}

Paths are relative to term.yaml. Without a roster the people are those of the classes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from decimal import Decimal
from pathlib import Path

import yaml

from grader import yaml_reader
from grader.classroom import cells, gradebook, roster
from grader.classroom.cells import Cell
from grader.classroom.class_folder import CLASS, ClassFolder
from grader.classroom.gradebook import NOTHING, Row, State, rounded
from grader.classroom.identity import Claim, identify
from grader.classroom.roster import Person
from grader.errors import GraderError
from grader.yaml_reader import YamlReader

FILE, TOTALS = "term.yaml", "totals.csv"
_PERSON = ("id", "name", "email", "login")


@dataclass(frozen=True)
class Sheet:
    """A class of the term; `weight` is what a person can reach in it of the term's points."""

    title: str
    folder: Path
    weight: Decimal


@dataclass(frozen=True)
class Term:
    """What term.yaml says."""

    title: str
    sheets: tuple[Sheet, ...]
    roster: tuple[Person, ...]


@dataclass(frozen=True)
class Total:
    """One person's line: the points of each sheet by its title, None where there is none yet or none is due.

    `total` is None while a sheet is open or in doubt. What is excused does not count: the others weigh more.
    """

    person: Person
    points: dict[str, Decimal | None]
    total: Decimal | None
    remarks: tuple[str, ...] = ()


@dataclass(frozen=True)
class Totals:
    """All lines, the points that can be reached, and what a person should look at before they are used."""

    lines: tuple[Total, ...]
    max: Decimal
    doubts: tuple[str, ...]


def read(path: Path) -> Term:
    """Return what a term.yaml, or that in the folder `path`, says.

    Raises:
        GraderError: it is not there, or has a mistake, which is named with its line.
    """
    file = path / FILE if path.is_dir() else path
    if not file.is_file():
        raise GraderError(f"There is no {file}. {_example(file.parent)}")
    if (root := yaml_reader.read(file)) is None:
        raise GraderError(f"{file} is empty. {_example(file.parent)}")
    return _Reader(file).read(root)


def add_up(term: Term) -> Totals:
    """Return everyone's total over the term.

    Raises:
        GraderError: a class of it cannot be read.
    """
    people = list(term.roster)
    rows: dict[int, dict[str, Row]] = {number: {} for number in range(len(people))}
    strangers: list[tuple[Sheet, Row, str]] = []
    for sheet in term.sheets:
        known = tuple(people)  # of the sheets before, so that the order within a sheet decides nothing
        found: dict[int, list[Row]] = {}
        for row in gradebook.read(ClassFolder(sheet.folder)).rows:
            who = identify(_claims(row.person), known)
            if len(who.people) == 1:
                found.setdefault(known.index(who.people[0]), []).append(row)
            elif who.why:
                names = " or ".join(_named(rival) for rival in who.rivals)
                strangers.append((sheet, row, f"{row.person.label} may be {names}: {who.why}"))
            elif term.roster:
                strangers.append((sheet, row, f"{row.person.label} is not in the roster"))
            else:
                found[len(people)] = [row]
                people.append(row.person)
        for number, several in found.items():
            if len(several) > 1:
                why = f"{_named(known[number])} has {len(several)} lines: {', '.join(r.submission for r in several)}"
                strangers += [(sheet, row, why) for row in several]
            else:
                rows.setdefault(number, {})[sheet.title] = several[0]
                people[number] = _joined(people[number], several[0].person)
    doubtful = {(sheet.title, person) for sheet, row, _ in strangers for person in _alike(row.person, people)}
    lines = [_total(person, rows[number], term.sheets, doubtful) for number, person in enumerate(people)]
    lines += [_total(row.person, {sheet.title: row}, (sheet,), set(), why) for sheet, row, why in strangers]
    doubts = [f"{sheet.title}: {why}." for sheet, _, why in strangers]
    doubts += [f"{line.person.label}: {remark}." for line in lines[: len(people)] for remark in line.remarks]
    return Totals(tuple(lines), sum((sheet.weight for sheet in term.sheets), NOTHING), tuple(dict.fromkeys(doubts)))


def write(term: Term, totals: Totals, path: Path) -> None:
    """Write the totals as CSV."""
    titles = [sheet.title for sheet in term.sheets]
    table: list[Sequence[Cell]] = [
        (*_PERSON, *(f"{sheet.title} ({sheet.weight:f})" for sheet in term.sheets), "total", "max", "remarks")
    ]
    for line in totals.lines:
        who = (getattr(line.person, name) for name in _PERSON)
        points = (line.points.get(title) for title in titles)
        table.append((*who, *points, line.total, totals.max, "; ".join(line.remarks)))
    cells.write(path, table)


def _claims(person: Person) -> list[Claim]:
    """Return what a class says of a person that holds in others, too. Moodle gives new numbers for each assignment."""
    found = [Claim(kind, value) for kind in ("id", "email", "login", "name") if (value := getattr(person, kind))]
    return [*found, Claim("lms_id", person.lms_id, person.lms)] if person.lms == "canvas" and person.lms_id else found


def _joined(one: Person, other: Person) -> Person:
    """Return a person with all that is known by either."""
    return replace(one, **{f.name: getattr(one, f.name) or getattr(other, f.name) for f in fields(Person)})


def _alike(person: Person, people: Sequence[Person]) -> tuple[Person, ...]:
    who = identify(_claims(person), people)
    return (*who.people, *who.rivals)


def _named(person: Person) -> str:
    kind, value = person.key
    return f"{person.label} ({kind} {value})" if kind != "name" else person.label


def _total(
    person: Person,
    rows: dict[str, Row],
    sheets: Sequence[Sheet],
    doubtful: set[tuple[str, Person]],
    why: str = "",
) -> Total:
    points: dict[str, Decimal | None] = {}
    remarks = [why] if why else []
    reached = counted = NOTHING
    for sheet in sheets:
        row = rows.get(sheet.title)
        if row is None and (sheet.title, person) in doubtful:
            remarks.append(f"{sheet.title} is in doubt")
            points[sheet.title] = None
        elif row is not None and row.state is State.EXCUSED:
            points[sheet.title] = None
        elif row is not None and not row.final:
            remarks.append(f"{sheet.title} is {row.state.value}")
            points[sheet.title] = None
        else:
            share = row.total / row.max if row is not None and row.total is not None and row.max else NOTHING
            points[sheet.title] = rounded(sheet.weight * share)
            reached, counted = reached + sheet.weight * share, counted + sheet.weight
    whole = sum((sheet.weight for sheet in sheets), NOTHING)
    return Total(
        person, points, rounded(reached * whole / counted) if counted and not remarks else None, tuple(remarks)
    )


class _Reader(YamlReader):
    def read(self, root: yaml.Node) -> Term:
        given = self.fields(root, root, ("sheets",), "a term", ("title", "roster"))
        sheets: list[Sheet] = []
        for node in self.items(given["sheets"]):
            sheet = self._sheet(node)
            if sheet.title in {other.title for other in sheets}:
                self.fail(node, f"two sheets are called {sheet.title}; give one of them another title")
            sheets.append(sheet)
        people = roster.load(self._path.parent / self.text(given["roster"])) if "roster" in given else ()
        return Term(self.text(given["title"]) if "title" in given else "", tuple(sheets), people)

    def _sheet(self, node: yaml.Node) -> Sheet:
        given = self.fields(node, node, ("class", "weight"), "a sheet", ("title",))
        name, weight = self.text(given["class"]), self.text(given["weight"])
        folder = self._path.parent / name
        if not (folder / CLASS).is_file():
            self.fail(given["class"], f"{folder} is not a class: it has no {CLASS}")
        try:
            value = Decimal(weight)
        except ArithmeticError:
            value = Decimal(0)
        if not value > 0:  # also refuses NaN, which compares False
            self.fail(given["weight"], f"{weight} is not a weight; write a number above 0")
        return Sheet(self.text(given["title"]) if "title" in given else name, folder, value)


def _example(folder: Path) -> str:
    """Return what to write into term.yaml, with the classes that are there."""
    found = sorted(path.parent.relative_to(folder).as_posix() for path in folder.glob(f"*/**/{CLASS}"))
    lines = [f"  - {{class: {name}, weight: 100}}" for name in found or ["sheet1/class", "sheet2/class"]]
    return "\n".join(["Write it like this:", "sheets:", *lines])
