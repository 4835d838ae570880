"""A class's gradebook: what the grader measured, what people decided, and what being late costs, for each person."""

from __future__ import annotations

import datetime as dt
from collections.abc import Hashable, Iterable, Sequence
from dataclasses import dataclass, field
from decimal import Decimal
from enum import Enum
from typing import Any

from grader.classroom import lateness, overrides
from grader.classroom.class_folder import RUBRIC, ClassFacts, ClassFolder, Record, Status
from grader.classroom.entry import Entry
from grader.classroom.lateness import LateRule
from grader.classroom.overrides import Decisions, PointsOverride
from grader.classroom.roster import Person
from grader.scoring import rubric
from grader.scoring.rubric import Rubric
from grader.scoring.scorecard import hundredths

HUNDREDTH, NOTHING = Decimal("0.01"), Decimal("0.00")


class State(Enum):
    """How a person stands."""

    GRADED = "graded"
    TO_GRADE = "to be graded by a person"
    """Some requirements of the rubric have no checks, and no points by a person yet."""
    INCOMPLETE = "incomplete"
    """An error of the grader left something without a verdict."""
    REFUSED = "cannot be graded"
    ERROR = "error of the grader"
    PENDING = "not graded yet"
    MISSING = "nothing handed in"
    EXCUSED = "excused"


@dataclass(frozen=True)
class RequirementPoints:
    """The points for one requirement: None while there are none. `override` is a person's decision."""

    id: str
    points: Decimal | None
    max: Decimal
    outcome: str
    override: PointsOverride | None = None


@dataclass(frozen=True)
class Row:
    """One person's line. `reached` is the sum of the requirements, `total` that without the `deduction` for lateness.

    `total` is None where a platform should show no grade: excused, or an error of ours.
    """

    person: Person
    state: State
    submission: str = ""
    requirements: tuple[RequirementPoints, ...] = ()
    reached: Decimal = NOTHING
    max: Decimal = NOTHING
    late_units: int = 0
    late_unit: str = "day"
    deduction: Decimal = NOTHING
    total: Decimal | None = None
    submitted: dt.datetime | None = None
    why: str = ""
    comments: tuple[str, ...] = ()
    flags: int = 0
    decided: tuple[str, ...] = field(default=())
    kit: str = ""
    """The kit that graded the submission, as Record.kits has it."""

    @property
    def comment(self) -> str:
        """Return a few sentences for the person: state, what people decided, lateness."""
        said = [self.why] if self.why else []
        if self.state not in (State.GRADED, State.MISSING) and not self.why:
            said.append(self.state.value)
        said += self.decided
        if self.late_units:
            units = f"{self.late_units} started {self.late_unit}{'s' if self.late_units > 1 else ''}"
            said.append(f"{units} late: {self.deduction} points deducted")
        return "; ".join([*said, *self.comments])


def rounded(points: float | Decimal | str) -> Decimal:
    """Return points with two decimals, half up: the one rounding rule of all that the kit writes."""
    return Decimal(str(hundredths(float(points)))).quantize(HUNDREDTH)


@dataclass(frozen=True)
class Gradebook:
    """All rows, in the order of the roster or of the submissions, and the rubric by which they were graded."""

    rubric: Rubric
    rows: tuple[Row, ...]
    decisions: Decisions
    late_rule: LateRule | None
    deadline: dt.datetime | None

    @property
    def max(self) -> Decimal:
        """Return the points of the whole rubric."""
        return rounded(sum(requirement.points for requirement in self.rubric.requirements))

    @property
    def kits(self) -> frozenset[str]:
        """Return the versions of the kit that graded the class."""
        return frozenset(row.kit for row in self.rows if row.kit)


def read(folder: ClassFolder) -> Gradebook:
    """Return the gradebook of a class, from its records, reports and overrides as they are now.

    Raises:
        GraderError: the class or its overrides cannot be read.
    """
    facts = folder.facts()
    whole = rubric.load(folder.path / RUBRIC)
    decisions = overrides.of_class(folder, facts, whole)
    rule = lateness.parse(facts.late_rule) if facts.late_rule else None
    rows: dict[Hashable, list[Row]] = {}
    for entry in facts.entries:
        for person in entry.people or (Person(name=entry.label),):
            # What fits nobody is one person's whatever its label: two of one name stay two.
            who = person.key if entry.people else entry.id
            rows.setdefault(who, []).append(_row(person, entry, folder, facts, whole, decisions, rule))
    for person in facts.missing:
        rows[person.key] = [_missing(person, decisions, whole)]
    best = (max(several, key=lambda row: (row.total is not None, row.total or 0)) for several in rows.values())
    return Gradebook(whole, tuple(sorted(best, key=_place)), decisions, rule, facts.deadline)


def _place(row: Row) -> tuple[str, str]:
    return row.person.key[1], row.submission


def of_one(report: dict[str, Any], whole: Rubric) -> Gradebook:
    """Return the gradebook of a single grading, such as one in a student's own repository."""
    name = str(report.get("submission", "submission"))
    if "requirements" not in report:
        why = str(report.get("refused", {}).get("because", "it could not be graded"))
        maximum = rounded(sum(requirement.points for requirement in whole.requirements))
        refused = Row(Person(name=name), State.REFUSED, name, max=maximum, total=NOTHING, why=why)
        return Gradebook(whole, (refused,), Decisions(), None, None)
    found = _requirements(whole, report, {})
    reached = sum((each.points or NOTHING for each in found), NOTHING)
    record = Record(name, Status.GRADED)
    row = Row(
        person=Person(name=name),
        state=_state(record, True, found),
        submission=name,
        requirements=found,
        reached=reached,
        max=sum((each.max for each in found), NOTHING),
        total=reached,
        flags=len(report.get("integrity", ())),
    )
    return Gradebook(whole, (row,), Decisions(), None, None)


def _row(
    person: Person,
    entry: Entry,
    folder: ClassFolder,
    facts: ClassFacts,
    whole: Rubric,
    decisions: Decisions,
    rule: LateRule | None,
) -> Row:
    record = folder.current(entry, facts)
    report = folder.report(entry.id) if record else None
    decided, about = decisions.on(entry.id), decisions.about(person)
    given = {override.requirement: override for override in decided.points}
    graded = record is not None and record.status is Status.GRADED and report is not None
    found = _requirements(whole, report if graded else None, given)
    reached = sum((each.points or NOTHING for each in found), NOTHING)
    maximum = sum((each.max for each in found), NOTHING)
    submitted = decided.submitted or entry.submitted
    until = about.extension.until if about.extension else facts.deadline
    units = rule.units(submitted, until) if rule and submitted and until else 0
    deduction = rounded(rule.deduction(units, reached, maximum)) if rule and units else NOTHING
    state = State.EXCUSED if about.excused else _state(record, graded, found)
    no_total = state in (State.EXCUSED, State.ERROR, State.PENDING)
    return Row(
        person=person,
        state=state,
        submission=entry.id,
        requirements=found,
        reached=reached,
        max=maximum,
        late_units=units,
        late_unit=rule.unit if rule else "day",
        deduction=deduction,
        total=None if no_total else reached - deduction,
        submitted=submitted,
        why=_why(record, about, late=entry.late and submitted is None),
        comments=(*decided.comments, *about.comments),
        flags=len(report.get("integrity", ())) if report else 0,
        decided=tuple(f"{o.requirement}: {o.points} points by {o.by} ({o.why})" for o in decided.points),
        kit=record.kits if record else "",
    )


def _missing(person: Person, decisions: Decisions, whole: Rubric) -> Row:
    about = decisions.about(person)
    if about.excused:
        return Row(person, State.EXCUSED, why=f"excused: {about.excused.why}", comments=about.comments)
    maximum = rounded(sum(requirement.points for requirement in whole.requirements))
    return Row(person, State.MISSING, max=maximum, total=NOTHING, why="nothing handed in", comments=about.comments)


def _requirements(
    whole: Rubric, report: dict[str, Any] | None, given: dict[str, PointsOverride]
) -> tuple[RequirementPoints, ...]:
    measured = {each["id"]: each for each in report["requirements"]} if report else {}
    return tuple(
        _requirement(
            requirement.id, rounded(requirement.points), measured.get(requirement.id), given.get(requirement.id)
        )
        for requirement in whole.requirements
    )


def _requirement(
    name: str, worth: Decimal, measured: dict[str, Any] | None, given: PointsOverride | None
) -> RequirementPoints:
    outcome = str(measured["outcome"]) if measured else "not_graded"
    if given is not None:
        return RequirementPoints(name, rounded(given.points), worth, outcome, given)
    if measured is None or outcome == "not_graded":
        return RequirementPoints(name, None, worth, outcome)
    return RequirementPoints(name, rounded(measured["points"]), worth, outcome)


def _state(record: Record | None, graded: bool, found: Sequence[RequirementPoints]) -> State:
    if all(each.override for each in found):
        return State.GRADED  # by a person, whatever the grader could do
    if record is None:
        return State.PENDING
    if record.status is Status.ERROR:
        return State.ERROR
    if not graded:
        return State.REFUSED
    if any(each.outcome == "error" and not each.override for each in found):
        return State.INCOMPLETE
    return State.TO_GRADE if any(each.points is None for each in found) else State.GRADED


def _why(record: Record | None, about: overrides.PersonDecision, late: bool) -> str:
    said: Iterable[str] = (
        f"excused: {about.excused.why}" if about.excused else "",
        f"extension until {about.extension.until:%Y-%m-%d %H:%M}: {about.extension.why}" if about.extension else "",
        record.why if record else "",
        "marked as late by the platform, which does not say by how much" if late else "",
    )
    return "; ".join(text for text in said if text)
