"""A class's gradebook: what the grader measured, what people decided, and what being late costs, for each person."""

from __future__ import annotations

import datetime as dt
from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from decimal import Decimal
from enum import Enum
from typing import Any

from grader.classroom import lateness, overrides
from grader.classroom.class_folder import RUBRIC, ClassFacts, ClassFolder, Entry, Record, Status
from grader.classroom.doubt import DoubtKind
from grader.classroom.lateness import LateRule
from grader.classroom.overrides import Accepted, Adjustment, Change, Decisions, PersonDecision, PointsOverride
from grader.classroom.roster import Person
from grader.host.namespaces import Confinement
from grader.scoring import rubric
from grader.scoring.rubric import FLAGS, Rubric
from grader.scoring.scorecard import hundredths

HUNDREDTH, NOTHING = Decimal("0.01"), Decimal("0.00")


class State(Enum):
    """How a person stands."""

    GRADED = "graded"
    TO_GRADE = "to be graded by a person"
    """Some requirements of the rubric have no checks, and no points by a person yet."""
    WITHHELD = "withheld until a person decides"
    """An integrity flag keeps points, as the rubric says, until a person decides."""
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

    @property
    def withheld(self) -> bool:
        """Return whether the points wait for a person, because of an integrity flag."""
        return self.outcome == "withheld" and self.override is None


@dataclass(frozen=True)
class Row:
    """One person's line. `reached` is the sum of the requirements, `total` what lateness and people leave of it.

    `total` is None where a platform should show no grade: excused, not graded yet, an error of ours, points that a flag
    withholds, or a hand-in that is missing or cannot be graded, until a person decides. `late` is in words. `decided`
    are decisions on the submission, `private` what concerns this person alone.
    """

    person: Person
    state: State
    submission: str = ""
    requirements: tuple[RequirementPoints, ...] = ()
    reached: Decimal = NOTHING
    max: Decimal = NOTHING
    late_units: int = 0
    late: str = ""
    deduction: Decimal = NOTHING
    total: Decimal | None = None
    grade: str = ""
    submitted: dt.datetime | None = None
    why: str = ""
    decided: tuple[str, ...] = ()
    private: tuple[str, ...] = ()
    comments: tuple[str, ...] = ()
    flags: int = 0
    kit: str = ""
    """The kit that graded the submission, as Record.kits has it."""
    confinement: str = ""
    """What kept the submission apart while it was graded, a value of Confinement; "" if it was not graded."""

    @property
    def final(self) -> bool:
        """Return whether nothing is left to be graded or decided."""
        return self.state is State.EXCUSED or (
            self.total is not None and self.state in (State.GRADED, State.REFUSED, State.MISSING)
        )

    @property
    def figures(self) -> tuple[object, ...]:
        """Return what a team's members share, unless one of them has an exception."""
        return (self.state, self.total, self.late, self.deduction)

    @property
    def comment(self) -> str:
        """Return a few sentences for the person: state, what people decided, lateness."""
        said = [*self.private, self.why] if self.why else list(self.private)
        if self.state not in (State.GRADED, State.MISSING) and not said:
            said.append(self.state.value)
        grade = f"grade {self.grade}" if self.grade else ""
        return "; ".join(filter(None, [*said, *self.decided, self.late, grade, *self.comments]))


def rounded(points: float | Decimal | str) -> Decimal:
    """Return points with two decimals, half up: the one rounding rule of all that the kit writes."""
    return Decimal(str(hundredths(float(points)))).quantize(HUNDREDTH)


@dataclass(frozen=True)
class Gradebook:
    """A class's grades, and the rubric by which they were graded.

    Attributes:
        rows: everybody's line, by id or name; of several submissions of one person the best.
        every: one line for each person of each submission.
        teams: by submission, what its people share: nobody's own extension, excuse or adjustment is in it.
    """

    rubric: Rubric
    rows: tuple[Row, ...]
    every: tuple[Row, ...]
    teams: Mapping[str, Row]
    decisions: Decisions = field(default_factory=Decisions)
    late_rule: LateRule | None = None
    deadline: dt.datetime | None = None

    @property
    def max(self) -> Decimal:
        """Return the points of the whole rubric."""
        return _worth(self.rubric)

    def apart(self) -> list[str]:
        """Return a remark on each person whose total is not their team's."""
        return [
            f"{row.submission}: {row.person.label} has {_shown(row)}, the team {_shown(self.teams[row.submission])}"
            for row in self.every
            if row.figures != self.teams[row.submission].figures
        ]

    @property
    def kits(self) -> frozenset[str]:
        """Return the versions of the kit that graded the class."""
        return frozenset(row.kit for row in self.rows if row.kit)

    @property
    def weakly_confined(self) -> tuple[str, ...]:
        """Return the submissions that were graded without namespaces."""
        confined = {row.submission: row.confinement for row in self.every if row.confinement}
        return tuple(sorted(name for name, how in confined.items() if how != Confinement.NAMESPACES.value))


def read(folder: ClassFolder) -> Gradebook:
    """Return the gradebook of a class, from its records, reports and overrides as they are now.

    Raises:
        GraderError: the class or its overrides cannot be read.
    """
    facts = folder.facts()
    whole = rubric.load(folder.path / RUBRIC)
    decisions = overrides.of_class(folder, facts, whole)
    facts = overrides.applied(facts, decisions)
    rule = lateness.parse(facts.late_rule) if facts.late_rule else None
    rows: dict[Hashable, list[Row]] = {}
    teams: dict[str, Row] = {}
    for entry in facts.entries:
        line = _line_of(entry, folder, facts, whole, decisions, rule)
        people = entry.people or (_unknown(entry, facts),)
        found = [line(person, decisions.about(person)) for person in people]
        for row in found:
            # What fits nobody is one person's whatever its label: two of one name stay two.
            rows.setdefault(row.person.key if entry.people else entry.id, []).append(row)
        teams[entry.id] = _shared(found, line(Person(name=entry.label), PersonDecision()))
    every = tuple(row for several in rows.values() for row in several)
    for person in facts.missing:
        rows[person.key] = [_missing(person, decisions, facts, whole)]
    best = (max(several, key=lambda row: (row.total is not None, row.total or 0)) for several in rows.values())
    return Gradebook(whole, tuple(sorted(best, key=_place)), every, teams, decisions, rule, facts.deadline)


def _place(row: Row) -> tuple[str, str]:
    return row.person.key[1], row.submission


def _shared(rows: Sequence[Row], plain: Row) -> Row:
    """Return what the people of a submission share; `plain` is without anybody's own exceptions."""
    if len(rows) == 1:
        return rows[0]
    if any(row.figures != rows[0].figures for row in rows):
        return plain
    return replace(rows[0], person=plain.person, private=(), comments=plain.comments)


def _shown(row: Row) -> str:
    return row.state.value if row.total is None else f"{row.total} points"


def _worth(whole: Rubric) -> Decimal:
    return rounded(sum(requirement.points for requirement in whole.requirements))


def of_one(report: dict[str, Any], whole: Rubric) -> Gradebook:
    """Return the gradebook of a single grading, such as one in a student's own repository."""
    name = str(report.get("submission", "submission"))
    # It may have been graded by another rubric than the course's.
    whole = replace(whole, withholds=report.get("flags", FLAGS[whole.withholds]) == FLAGS[True])
    if "requirements" not in report:
        refusal = report.get("refused", {"because": "it could not be graded"})
        why = " ".join(str(refusal[name]) for name in ("because", "try") if refusal.get(name))
        refused = Row(Person(name=name), State.REFUSED, name, max=_worth(whole), total=NOTHING, why=why)
        return Gradebook(whole, (refused,), (refused,), {name: refused})
    found = _requirements(whole, report, {}, None)
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
        why=_withheld(found),
        flags=len(report.get("integrity", ())),
    )
    row = replace(row, grade=_grade(whole, row))
    return Gradebook(whole, (row,), (row,), {name: row})


def _line_of(
    entry: Entry, folder: ClassFolder, facts: ClassFacts, whole: Rubric, decisions: Decisions, rule: LateRule | None
) -> Callable[[Person, PersonDecision], Row]:
    """Return what makes the line of a person of a submission; only what is decided about them tells it from others."""
    record, on = folder.current(entry, facts), decisions.on(entry.id)
    report = folder.report(entry.id) if record else None
    graded = record is not None and record.status is Status.GRADED and report is not None
    # A text or a link instead of a package is worth what a person says: points, or `adjust: {total: 0}`.
    no_package = any(d.kind is DoubtKind.LEFT_OUT and d.entry == entry.id for d in facts.doubts)
    given = {override.requirement: override for override in on.points}
    found = _requirements(whole, report if graded else None, given, on.flags_accepted)

    def line(person: Person, about: PersonDecision) -> Row:
        reached = sum((each.points or NOTHING for each in found), NOTHING)
        maximum = sum((each.max for each in found), NOTHING)
        submitted = on.submitted or entry.submitted
        until = about.extension.until if about.extension else facts.deadline
        units, late, deduction = 0, "", NOTHING
        if rule and submitted and until and (units := rule.units(submitted, until)):
            deduction = rounded(rule.deduction(submitted, until, reached, maximum))
            too = ", too late to be accepted" if rule.too_late(submitted, until) else ""
            late = f"{rule.counted(units)} late{too}: {deduction} points deducted"
        state = _state(record, graded, found)
        if state is State.REFUSED and no_package:
            state = State.PENDING
        adjustments = (*on.adjustments, *about.adjustments)
        left = reached - deduction
        decided = facts.zero_missing or on.points
        state, total = _adjusted(state, left if decided or state is not State.REFUSED else None, maximum, adjustments)
        if about.excused:
            state, total = State.EXCUSED, None
        row = Row(
            person=person,
            state=state,
            submission=entry.id,
            requirements=found,
            reached=reached,
            max=maximum,
            late_units=units,
            late=late,
            deduction=deduction,
            total=total,
            submitted=submitted,
            why=_why(record, found, late=entry.late and submitted is None),
            decided=(
                *(f"{o.requirement}: {o.points} points by {o.by} ({o.why})" for o in on.points),
                *([str(on.flags_accepted)] if on.flags_accepted else []),
                *map(str, on.adjustments),
            ),
            private=_private(about),
            comments=(*on.comments, *about.comments),
            flags=len(report.get("integrity", ())) if report else 0,
            kit=record.kits if record else "",
            confinement=str(report.get("confinement", "")) if graded and report else "",
        )
        return replace(row, grade=_grade(whole, row))

    return line


def _unknown(entry: Entry, facts: ClassFacts) -> Person:
    """Return the person of a submission that matches nobody: the platform's number says who it is there."""
    return Person(name=entry.label, lms_id=entry.number, lms=facts.layout if entry.number else "")


def _missing(person: Person, decisions: Decisions, facts: ClassFacts, whole: Rubric) -> Row:
    """Return the line of a person without a submission; nothing is final while one may be theirs."""
    about, doubt = decisions.about(person), facts.doubt_about(person)
    state = State.PENDING if doubt else State.MISSING
    left = NOTHING if facts.zero_missing else None
    state, total = _adjusted(state, left, _worth(whole), about.adjustments)
    if about.excused:
        state, total = State.EXCUSED, None
    why = "nothing handed in"
    if doubt:
        why = doubt.what if doubt.kind is DoubtKind.LOST else f"a submission may be theirs: {doubt.label}"
    row = Row(
        person,
        state,
        max=_worth(whole),
        total=total,
        why="" if about.excused else why,
        private=_private(about),
        comments=about.comments,
    )
    return replace(row, grade=_grade(whole, row))


def _adjusted(
    state: State, left: Decimal | None, maximum: Decimal, adjustments: Sequence[Adjustment]
) -> tuple[State, Decimal | None]:
    """Return the state and the total after people's adjustments in their order, a bonus last.

    `left` is None where a person has to decide what it is worth. A total by a person is a grade whatever the grader
    could do; points and a bonus are not.
    """
    total = None if state in (State.ERROR, State.PENDING, State.WITHHELD) else left
    for each in sorted(adjustments, key=lambda adjustment: adjustment.change is Change.BONUS):
        if each.change is Change.TOTAL:
            state, total = State.GRADED, each.points
        elif total is not None:
            most = total + each.points if each.change is Change.BONUS else maximum
            total = min(most, max(NOTHING, total + each.points))
    return state, None if total is None else rounded(total)


def _grade(whole: Rubric, row: Row) -> str:
    return whole.grade(float(row.total)) if row.final and row.total is not None else ""


def _requirements(
    whole: Rubric, report: dict[str, Any] | None, given: Mapping[str, PointsOverride], accepted: Accepted | None
) -> tuple[RequirementPoints, ...]:
    measured = {each["id"]: each for each in report["requirements"]} if report else {}
    if accepted:
        held = {name: each["withheld"] for name, each in measured.items() if each["outcome"] == "withheld"}
        given = {name: accepted.of(name, points) for name, points in held.items()} | dict(given)
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
    if measured is None or outcome in ("not_graded", "withheld"):
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
    if any(each.withheld for each in found):
        return State.WITHHELD
    return State.TO_GRADE if any(each.points is None for each in found) else State.GRADED


def _why(record: Record | None, found: Sequence[RequirementPoints], late: bool) -> str:
    said: Iterable[str] = (
        record.why if record else "",
        _withheld(found),
        "marked as late by the platform, which does not say by how much" if late else "",
    )
    return "; ".join(text for text in said if text)


def _withheld(found: Sequence[RequirementPoints]) -> str:
    ids = ", ".join(each.id for each in found if each.withheld)
    return f"the points of {ids} are withheld until a person decides" if ids else ""


def _private(about: PersonDecision) -> tuple[str, ...]:
    """Return what was decided about one person, in words."""
    said: Iterable[str] = (
        f"excused: {about.excused.why}" if about.excused else "",
        f"extension until {about.extension.until:%Y-%m-%d %H:%M}: {about.extension.why}" if about.extension else "",
        *map(str, about.adjustments),
    )
    return tuple(text for text in said if text)
