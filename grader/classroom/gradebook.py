"""A class's gradebook: what the grader measured, what people decided, and what being late costs, for each person."""

from __future__ import annotations

import datetime as dt
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from decimal import Decimal
from enum import Enum
from typing import Any

from grader.classroom import overrides, times
from grader.classroom.class_folder import RUBRIC, ClassFacts, ClassFolder, DoubtKind, Entry, Record, Status
from grader.classroom.overrides import Adjustment, Decisions, PersonDecision, Reason
from grader.classroom.roster import Person
from grader.classroom.times import LateRule
from grader.host.namespaces import Confinement
from grader.scoring import rubric
from grader.scoring.grading import Decision
from grader.scoring.rubric import FLAGS, Rubric
from grader.scoring.scorecard import hundredths
from grader.words import counted

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
    override: Decision | None = None

    @property
    def lost(self) -> Decimal:
        """Return the points that are missing, none while there are no points."""
        return NOTHING if self.points is None else self.max - self.points

    @property
    def withheld(self) -> bool:
        """Return whether the points wait for a person, because of an integrity flag."""
        return self.outcome == "withheld" and self.override is None


@dataclass(frozen=True)
class Row:
    """One person's line: `total` is what lateness and people leave of the sum of the requirements.

    `total` is None where a platform should show no grade: excused, not graded yet, an error of ours, points that a flag
    withholds, or a hand-in that is missing or cannot be graded, until a person decides. `late` is in words. `decided`
    are decisions on the submission, `private` what concerns this person alone.
    """

    person: Person
    state: State
    submission: str = ""
    requirements: tuple[RequirementPoints, ...] = ()
    max: Decimal = NOTHING
    late_days: int = 0
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
    def reached(self) -> Decimal:
        """Return the sum of the requirements."""
        return sum((each.points or NOTHING for each in self.requirements), NOTHING)

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

    @property
    def max(self) -> Decimal:
        """Return the points of the whole rubric."""
        return _worth(self.rubric)

    def apart(self) -> list[str]:
        """Return a remark on each person whose total is not their team's."""

        def shown(row: Row) -> str:
            return row.state.value if row.total is None else f"{row.total} points"

        return [
            f"{row.submission}: {row.person.label} has {shown(row)}, the team {shown(self.teams[row.submission])}"
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
    rule = times.late_rule(facts.late_rule) if facts.late_rule else None
    rows: dict[Hashable, list[Row]] = {}
    teams: dict[str, Row] = {}
    for entry in facts.entries:
        line = _line_of(entry, folder, facts, whole, decisions, rule)
        # Whoever is not known is there what the platform's number says.
        unknown = Person(name=entry.label, lms_id=entry.number, lms=facts.layout if entry.number else "")
        found = [line(person, decisions.about(person)) for person in entry.people or (unknown,)]
        for row in found:
            # What fits nobody is one person's whatever its label: two of one name stay two.
            rows.setdefault(row.person.key if entry.people else entry.id, []).append(row)
        shared = line(Person(name=entry.label), PersonDecision())  # without anybody's own exceptions
        if len(found) > 1 and all(row.figures == found[0].figures for row in found):
            shared = replace(found[0], person=shared.person, private=(), comments=shared.comments)
        teams[entry.id] = shared if len(found) > 1 else found[0]
    every = tuple(row for several in rows.values() for row in several)
    for person in facts.missing:
        rows[person.key] = [_missing(person, decisions.about(person), facts, whole)]
    best = (max(several, key=lambda row: (row.total is not None, row.total or 0)) for several in rows.values())
    placed = sorted(best, key=lambda row: (row.person.key[1], row.submission))
    return Gradebook(whole, tuple(placed), every, teams, decisions)


def of_one(report: dict[str, Any], whole: Rubric) -> Gradebook:
    """Return the gradebook of a single grading, such as one in a student's own repository."""
    name = str(report.get("submission", "submission"))
    # It may have been graded by another rubric than the course's.
    whole = replace(whole, withholds=report.get("flags", FLAGS[whole.withholds]) == FLAGS[True])
    row = Row(Person(name=name), State.REFUSED, name, max=_worth(whole), total=NOTHING)
    if "requirements" in report:
        found = _requirements(whole, report, {}, None)
        state, flags = _state(Record(name, Status.GRADED), True, found), len(report.get("integrity", ()))
        row = replace(row, requirements=found, why=_withheld(found), flags=flags)
        row = _with_total(row, state, row.reached, whole)
    else:
        refusal = report.get("refused", {"because": "it could not be graded"})
        row = replace(row, why=" ".join(str(refusal[name]) for name in ("because", "try") if refusal.get(name)))
    return Gradebook(whole, (row,), (row,), {name: row})


def _worth(whole: Rubric) -> Decimal:
    return rounded(sum(requirement.points for requirement in whole.requirements))


def _with_total(row: Row, state: State, total: Decimal | None, whole: Rubric) -> Row:
    row = replace(row, state=state, total=total)
    return replace(row, grade=whole.grade(float(total))) if row.final and total is not None else row


def _line_of(
    entry: Entry, folder: ClassFolder, facts: ClassFacts, whole: Rubric, decisions: Decisions, rule: LateRule | None
) -> Callable[[Person, PersonDecision], Row]:
    """Return what makes the line of a person of a submission; only what is decided about them tells it from others."""
    record, on = folder.current(entry, facts), decisions.on(entry.id)
    report = folder.report(entry.id) if record else {}
    graded = record is not None and record.status is Status.GRADED and bool(report)
    given = {override.requirement: override for override in on.points}
    found = _requirements(whole, report if graded else None, given, on.flags_accepted)
    state = _state(record, graded, found)
    # A text or a link instead of a package is worth what a person says: points, or `adjust: {total: 0}`.
    if state is State.REFUSED and any(d.kind is DoubtKind.LEFT_OUT and d.entry == entry.id for d in facts.doubts):
        state = State.PENDING
    submitted = entry.submitted
    marked = [times.MARKED] if entry.late and submitted is None else []
    accepted = [f"flags accepted by {a.by} ({a.why})"] if (a := on.flags_accepted) else []
    points = [f"{o.requirement}: {o.points:g} points by {o.by} ({o.why})" for o in on.points]
    shared = Row(
        person=Person(),
        state=state,
        submission=entry.id,
        requirements=found,
        max=sum((each.max for each in found), NOTHING),
        submitted=submitted,
        why="; ".join(filter(None, [record.why if record else "", _withheld(found), *marked])),
        decided=(*points, *accepted, *map(str, on.adjustments)),
        comments=on.comments,
        flags=len(report.get("integrity", ())),
        kit=record.kits if record else "",
        confinement=str(report.get("confinement", "")) if graded else "",
    )

    def line(person: Person, about: PersonDecision) -> Row:
        until = about.extension.until if about.extension else facts.deadline
        days, late, deduction = 0, "", NOTHING
        if rule and submitted and until and (days := rule.days(submitted, until)):
            deduction = rounded(rule.deduction(submitted, until, shared.reached, shared.max))
            too = ", too late to be accepted" if rule.too_late(submitted, until) else ""
            late = f"{counted(days, 'started day')} late{too}: {deduction} points deducted"
        row = replace(shared, person=person, late_days=days, late=late, deduction=deduction)
        decided = facts.zero_missing or on.points or state is not State.REFUSED
        return _decided(row, shared.reached - deduction if decided else None, about, on.adjustments, whole)

    return line


def _missing(person: Person, about: PersonDecision, facts: ClassFacts, whole: Rubric) -> Row:
    """Return the line of a person without a submission; nothing is final while one may be theirs."""
    why, doubt = "nothing handed in", facts.doubt_about(person)
    if doubt:
        why = doubt.what if doubt.kind is DoubtKind.LOST else f"a submission may be theirs: {doubt.label}"
    state = State.PENDING if doubt else State.MISSING
    row = Row(person, state, max=_worth(whole), why="" if about.excused else why)
    return _decided(row, NOTHING if facts.zero_missing else None, about, (), whole)


def _decided(
    row: Row, left: Decimal | None, about: PersonDecision, adjustments: tuple[Adjustment, ...], whole: Rubric
) -> Row:  # fmt: skip
    """Return the line with what is `left` of the points after lateness, and with what is decided about the person."""
    state, total = _adjusted(row.state, left, row.max, (*adjustments, *about.adjustments))
    if about.excused:
        state, total = State.EXCUSED, None
    said = [
        *([f"excused: {about.excused.why}"] if about.excused else []),
        *([f"extension until {e.until:%Y-%m-%d %H:%M}: {e.why}"] if (e := about.extension) else []),
        *map(str, about.adjustments),
    ]
    row = replace(row, private=tuple(said), comments=(*row.comments, *about.comments))
    return _with_total(row, state, total, whole)


def _adjusted(
    state: State, left: Decimal | None, maximum: Decimal, adjustments: Sequence[Adjustment]
) -> tuple[State, Decimal | None]:
    """Return the state and the total after people's adjustments in their order, a bonus last.

    `left` is None where a person has to decide what it is worth. A total by a person is a grade whatever the grader
    could do; points and a bonus are not.
    """
    total = None if state in (State.ERROR, State.PENDING, State.WITHHELD) else left
    for each in sorted(adjustments, key=lambda adjustment: adjustment.change == "bonus"):
        if each.change == "total":
            state, total = State.GRADED, each.points
        elif total is not None:
            most = total + each.points if each.change == "bonus" else maximum
            total = min(most, max(NOTHING, total + each.points))
    return state, None if total is None else rounded(total)


def _requirements(
    whole: Rubric, report: dict[str, Any] | None, given: Mapping[str, Decision], accepted: Reason | None
) -> tuple[RequirementPoints, ...]:
    measured = {each["id"]: each for each in report["requirements"]} if report else {}
    if accepted:
        held = [each for each in measured.values() if each["outcome"] == "withheld"]
        why = f"flags accepted: {accepted.why}"
        given = {each["id"]: Decision(each["id"], each["withheld"], why, accepted.by) for each in held} | dict(given)
    found = []
    for requirement in whole.requirements:
        own, override = measured.get(requirement.id), given.get(requirement.id)
        outcome = str(own["outcome"]) if own else "not_graded"
        points = None if own is None or outcome in ("not_graded", "withheld") else rounded(own["points"])
        points = points if override is None else rounded(override.points)
        found.append(RequirementPoints(requirement.id, points, rounded(requirement.points), outcome, override))
    return tuple(found)


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


def _withheld(found: Sequence[RequirementPoints]) -> str:
    ids = ", ".join(each.id for each in found if each.withheld)
    return f"the points of {ids} are withheld until a person decides" if ids else ""
