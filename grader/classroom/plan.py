"""What a run will do, before it does it.

What the first run of a class decides, later runs keep: sources, roster, rubric, seed, deadline and late rule. Then for
each submission: whose it is, which hand-in counts, how late, what is done, and why.
"""

from __future__ import annotations

import datetime as dt
from argparse import Namespace
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from enum import Enum
from pathlib import Path
from statistics import mean
from typing import Any

from grader.classroom import cells, times
from grader.classroom.class_folder import ClassFacts, ClassFolder, Doubt, DoubtKind, Entry, Record, Status
from grader.classroom.matching import GO_ON
from grader.classroom.overrides import Decisions
from grader.classroom.roster import Person
from grader.classroom.times import HandInTime, LateRule, clock
from grader.errors import UsageError
from grader.sanitize import printable
from grader.words import counted, some

SECONDS_EACH = 45.0
"""Wall time of a whole grading on two cores, as docs/classes.md measured it; for a class without any grade yet."""

_HEADER = ("id", "label", "people", "matched by", "hand-in", "submitted", "late", "will be", "why")
_WIDTHS = (20, 24, 28, 26, 22, 34, 17, 50)


_OTHER_KIT = "by another kit"
_VOID = ("seed", "rubric")
"""The settings of which another value makes all grades void; any other only says whose a grade is, or how late."""


@dataclass(frozen=True)
class Options:
    """What a run's command says. None leaves a setting of the class as it is.

    Attributes:
        course: the folder of the course, for a new class.
        added: further sources, read together with the class's own.
        times: when submissions were handed in, where the sources do not say it; the class remembers them.
        only: the submissions to grade; all if it is empty.
        regrade: grade again what another kit has graded.
        fresh: grade everything again, from nothing that is kept.
        despite_doubts: grade even where a doubt about whose the submissions are would stop the class.
        minutes: after which the grading of one submission is ended.
        zero_missing: whether missing, empty and damaged hand-ins get 0.
        scheduler: a Dask scheduler's address, "" for this machine with `jobs` submissions at a time.
    """

    course: Path | None = None
    rubric: Path | None = None
    seed: int | None = None
    deadline: dt.datetime | None = None
    late_rule: str | None = None
    added: Sequence[Path] = ()
    times: tuple[HandInTime, ...] = ()
    only: Collection[str] = ()
    regrade: bool = False
    fresh: bool = False
    despite_doubts: bool = False
    zero_missing: bool | None = None
    jobs: int = 0
    minutes: int = 60
    scheduler: str = ""

    @classmethod
    def of(cls, command: Namespace, times: tuple[HandInTime, ...]) -> Options:
        """Return what a command says, whose options have the names of these fields."""
        given = {field.name: getattr(command, field.name) for field in fields(cls)}
        return cls(**given | {"times": times})


def settle(
    folder: ClassFolder, before: ClassFacts | None, source: Path | None, people: Sequence[Person] | None,
    rubric: str | None, options: Options,
) -> tuple[ClassFacts, list[str]]:  # fmt: skip
    """Return the class as it was `before` but for what the command says, and a remark on each setting that changes.

    Source, people and the hash of a rubric are None where the command does not name them.

    Raises:
        UsageError: another seed or rubric is given than the class has, and not to grade everything anew.
        GraderError: the late rule is none.
    """
    if options.late_rule:
        times.late_rule(options.late_rule)
    had = before or ClassFacts()
    if before and source and Path(had.source).resolve() == source.resolve():
        source = None
    given = {
        "source": str(source) if source else None,
        "roster": None if people is None else tuple(people),
        "rubric": rubric,
        **{name: getattr(options, name) for name in ("seed", "deadline", "late_rule")},
    }
    new: dict[str, Any] = {name: value for name, value in given.items() if value is not None}
    changed = [name for name, value in new.items() if before and getattr(had, name) != value]
    if void := [] if options.fresh else [name for name in changed if name in _VOID]:
        raise UsageError(
            f"{folder.path} has another {void[0]}. With this one all grades are void: every submission is graded "
            "again, though `grader rescore CLASS --rubric FILE` judges the saved evidence by a rubric in seconds.",
            f"Add --fresh if that is meant; otherwise leave out --{void[0]}: the class knows it.",
        )
    now = replace(had, **new)
    sources = {Path(now.source).resolve(): now.source}
    for each in (*(() if "source" in changed else had.added), *map(str, options.added)):
        sources.setdefault(Path(each).resolve(), each)
    remarks = [
        f"The {name.replace('_', ' ')} was {_words(getattr(had, name))}, and is {_words(new[name])} from now on."
        for name in changed
        if name not in _VOID
    ]
    return replace(now, added=tuple(sources.values())[1:]), remarks


def _words(value: Any) -> str:
    if isinstance(value, tuple):
        return counted(len(value), "person", "people")
    return f"{value:%Y-%m-%d %H:%M}" if isinstance(value, dt.datetime) else f"{value or 'none'}"


class Action(Enum):
    """What a run does with a submission."""

    GRADE = "graded"
    KEEP = "kept"
    LEAVE = "left as it is"
    WAIT = "not graded yet"
    """Nothing to grade, but a doubt says that there may be."""
    NOTHING = "nothing handed in"


@dataclass(frozen=True)
class Decision:
    """What is done with a submission, and why."""

    action: Action
    why: str


@dataclass(frozen=True)
class PlanRow:
    """One submission, or one person without any; `late` is by how much."""

    decision: Decision
    people: tuple[Person, ...]
    entry: Entry | None = None
    late: str = ""

    @property
    def cells(self) -> tuple[str, ...]:
        """Return the cells of plan.csv."""
        entry = self.entry or Entry("", "", Path(), "")
        return (
            entry.id,
            entry.label,
            ", ".join(person.label for person in self.people),
            ", ".join(dict.fromkeys(each.text for each in entry.matched)),
            " ".join(entry.notes),
            entry.submitted.isoformat(sep=" ", timespec="minutes") if entry.submitted else "",
            self.late,
            self.decision.action.value,
            self.decision.why,
        )


@dataclass(frozen=True)
class Plan:
    """What a run will do.

    Attributes:
        rows: the submissions, and the people without any.
        facts: the class with people's decisions applied.
        new: the doubts that no run had before.
        lost: what to do about each submission without a grade that no source has any more.
        seconds: an estimate of the run's wall time.
        at_a_time: how many submissions are graded side by side.
        minutes: after which the grading of one submission is ended.
    """

    rows: tuple[PlanRow, ...]
    facts: ClassFacts
    new: tuple[Doubt, ...]
    lost: tuple[str, ...]
    seconds: float
    at_a_time: int
    minutes: int

    def of(self, action: Action) -> list[PlanRow]:
        """Return the rows with this action."""
        return [row for row in self.rows if row.decision.action is action]


def decide(entry: Entry, record: Record | None, job: Record, options: Options) -> Decision:
    """Return what to do with a submission. `record` says how it was graded, `job` how it would be graded now."""
    asked = not options.only or entry.id in options.only
    if record is None or record.status is Status.ERROR or not record.holds(job.content, job.rubric, job.seed):
        why = _cause(record, job)
        if entry.absent:
            return Decision(Action.LEAVE, f"{why}, but the submission is in none of the sources")
        return Decision(Action.GRADE, why) if asked else Decision(Action.LEAVE, f"{why}, and not named by --only")
    if asked and not entry.absent:
        if options.fresh:
            return Decision(Action.GRADE, "--fresh")
        if record.package != job.package:
            return Decision(Action.GRADE, "another package is to be graded")
        if options.regrade and record.kit != job.kit:
            return Decision(Action.GRADE, "--regrade: another kit graded it")
    kept = f"graded {record.started.replace('T', ' ')[:16]}".strip()
    if record.status is Status.REFUSED:
        kept = f"cannot be graded: {record.why}"
    where = "; in an earlier source only" if entry.absent else ""
    by = "" if record.kit == job.kit else f"; {_OTHER_KIT} ({record.kits})"
    return Decision(Action.KEEP, f"{kept}{by}{where}")


def _cause(record: Record | None, job: Record) -> str:
    if record is None:
        return "not graded yet"
    if record.content != job.content:
        return "handed in again"
    if record.status is Status.ERROR:
        return "the last run ended in an error of the grader"
    return f"the seed was {record.seed}" if record.seed != job.seed else "the rubric was another one"


def make(
    facts: ClassFacts, decided: Decisions, decisions: Mapping[str, Decision], records: Iterable[Record],
    new: Iterable[Doubt], at_a_time: int, minutes: int,
) -> Plan:  # fmt: skip
    """Return the plan of a run over a class to which people's decisions are applied.

    `decisions` are by the entries' ids, `records` all that the class has, and `new` the doubts that no run had before.
    """
    rule = times.late_rule(facts.late_rule) if facts.late_rule else None
    rows = [PlanRow(decisions[e.id], e.people, e, _late(e, facts, decided, rule)) for e in facts.entries]
    for person in facts.missing:
        doubt = facts.doubt_about(person)
        if doubt is None:
            decision = Decision(Action.NOTHING, "0 points" if facts.zero_missing else "open until a person decides")
        else:
            theirs = doubt.kind is DoubtKind.LOST and not doubt.anyone
            decision = Decision(Action.WAIT, doubt.what if theirs else f"unless {doubt.label} is theirs")
        rows.append(PlanRow(decision, (person,)))
    seconds = [record.seconds for record in records if record.status is Status.GRADED and record.seconds]
    todo = sum(row.decision.action is Action.GRADE for row in rows)
    lost = (
        f"{row.entry.id} has no grade ({row.decision.why}). Add the source that has it with --add."
        for row in rows
        if row.entry and row.entry.absent and row.decision.action is Action.LEAVE
    )
    wall = (mean(seconds) if seconds else SECONDS_EACH) * todo / min(at_a_time, max(todo, 1))
    return Plan(tuple(rows), facts, tuple(new), tuple(lost), wall, at_a_time, minutes)


def _late(entry: Entry, facts: ClassFacts, decided: Decisions, rule: LateRule | None) -> str:
    """Return by how much a submission is late; of a team whose members have other deadlines, for each of them."""
    if entry.submitted is None:
        return "marked as late by the platform" if entry.late else "time unknown" if facts.deadline else ""
    names: dict[str, list[str]] = {}
    for person in entry.people or (Person(),):
        extension = decided.about(person).extension
        until = extension.until if extension else facts.deadline
        by = times.late_by(entry.submitted, until, rule) if until else ""
        text = (f"late by {by}" if by else "in time" if until else "") + (", with an extension" if extension else "")
        names.setdefault(text, []).append(person.label)
    if len(names) == 1:
        return next(iter(names))
    return "; ".join(f"{', '.join(people)}: {text}" for text, people in names.items())


def write(plan: Plan, path: Path) -> None:
    """Write the plan as CSV."""
    cells.write(path, [_HEADER, *(row.cells for row in plan.rows)])


def table(plan: Plan) -> Iterator[str]:
    """Return the plan as lines of a table for a console; long cells are cut, plan.csv has them whole."""
    rows = [
        tuple(text for name, text in zip(_HEADER, cells, strict=True) if name != "hand-in")
        for cells in (_HEADER, *(row.cells for row in plan.rows))
    ]
    widths = [min(most, max(len(row[column]) for row in rows)) for column, most in enumerate(_WIDTHS)]
    for row in rows:
        yield "  ".join(printable(text, width).ljust(width) for text, width in zip(row, widths, strict=True)).rstrip()


def summary(plan: Plan) -> Iterator[str]:
    """Return the plan in a few lines: what is kept, what is to do and how long it takes, and every doubt in full."""
    todo, kept, left, waiting, missing = map(
        plan.of, (Action.GRADE, Action.KEEP, Action.LEAVE, Action.WAIT, Action.NOTHING)
    )
    how_long = f", about {clock(plan.seconds)} with {plan.at_a_time} at a time, {plan.minutes} minutes for each at most"
    more = f", {len(left)} left as they are" * bool(left) + how_long * bool(todo)
    yield f"{counted(len(plan.facts.entries), 'submission')}: {len(kept)} kept, {len(todo)} to be graded{more}"
    causes = Counter(row.decision.why for row in todo)
    yield from (f"  {count} to be graded: {why}" for why, count in causes.most_common())
    matched = Counter(each.means for entry in plan.facts.entries for each in entry.matched)
    if matched:
        yield "  people matched by " + ", ".join(f"{kind}: {count}" for kind, count in matched.most_common())
    if late := [row.entry.id for row in plan.rows if row.entry and "late by" in row.late]:
        yield f"  {len(late)} late: {some(late)}"
    if missing:
        yield f"  {counted(len(missing), 'person', 'people')} handed in nothing"
    if waiting:
        people = counted(len(waiting), "person", "people")
        yield f"  not graded yet, because of a doubt: {people} without a submission"
    if other_kit := [row.entry.id for row in kept if row.entry and _OTHER_KIT in row.decision.why]:
        yield f"  {len(other_kit)} kept from another kit: {some(other_kit)}; --regrade grades them again"
    if absent := [row.entry.id for row in kept if row.entry and row.entry.absent]:
        yield f"  {len(absent)} kept from an earlier source, and in none of the present ones: {some(absent)}"
    if plan.facts.late_rule:
        without = "" if plan.facts.deadline else "; without a deadline nothing is late"
        yield f"  late rule: {plan.facts.late_rule}{without}"
    yield from (f"ledger: {line}" for line in plan.facts.ledger)
    yield from (f"note: {note}" for note in plan.facts.notes)
    stops = [doubt for doubt in plan.new if doubt.stops]
    for doubt in plan.facts.doubts:
        yield f"DOUBT{', stops' if doubt in stops else ''}: {doubt.text}"
    yield from (f"DOUBT: {each}" for each in plan.lost)
    if stops:
        doubts = f"{counted(len(stops), 'doubt')} {'stops' if len(stops) == 1 else 'stop'}"
        yield f"{doubts} the class: nothing is graded before a person has looked, or says {GO_ON}."
