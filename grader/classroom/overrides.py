"""Read overrides.yaml: what people have decided about a class. Every mistake in it is named with its line.

    submissions:
      team07:
        points:
          F4: {points: 3, why: "the wall stood in the start", by: "A. Lovelace"}
        adjust: {points: -2, why: "handed in a build folder", by: "A. Lovelace"}
        flags_accepted: {why: "a generated parser", by: "A. Lovelace"}
        comments: ["A fine README."]
        submitted: 2026-11-21T10:00
        package: ws/src/controller
      stranger:
        people: [s1237]
    people:
      s1234:
        extension: {until: 2026-11-25T23:59, why: "ill", by: "A. Lovelace"}
        bonus: {points: 3, why: "found a fault in the simulator", by: "A. Lovelace"}
      s1235:
        excused: {why: "passed last year", by: "A. Lovelace"}
      s1236:
        adjust: {total: 50, why: "oral exam", by: "A. Lovelace"}

The kit never writes this file.
"""

from __future__ import annotations

import datetime as dt
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from decimal import Decimal
from enum import Enum
from pathlib import Path

import yaml

from grader import yaml_reader
from grader.classroom.class_folder import ClassFacts, ClassFolder
from grader.classroom.doubt import Doubt, DoubtKind, too_many
from grader.classroom.identity import ANY, Claim, identify
from grader.classroom.roster import IDENTITY, Person
from grader.classroom.times import local_time
from grader.scoring.rubric import Rubric
from grader.yaml_reader import YamlReader


@dataclass(frozen=True)
class PointsOverride:
    """The points that a person gives for a requirement, instead of the grader's."""

    requirement: str
    points: Decimal
    why: str
    by: str


@dataclass(frozen=True)
class Accepted:
    """Integrity flags need not keep any points."""

    why: str
    by: str

    def __str__(self) -> str:
        return f"flags accepted by {self.by} ({self.why})"

    def of(self, requirement: str, points: float) -> PointsOverride:
        """Return what this gives for a requirement whose measured `points` are withheld."""
        return PointsOverride(requirement, Decimal(str(points)), f"flags accepted: {self.why}", self.by)


@dataclass(frozen=True)
class Excuse:
    """No grade is expected."""

    why: str
    by: str


@dataclass(frozen=True)
class Extension:
    """A later deadline."""

    until: dt.datetime
    why: str
    by: str


class Change(Enum):
    """What an adjustment does to the points that are left after lateness."""

    POINTS = "points"
    """Adds points, or subtracts them; the total stays between 0 and the maximum."""
    TOTAL = "total"
    """Sets the total, whatever was graded."""
    BONUS = "bonus"
    """Adds points at last, also beyond the maximum."""


@dataclass(frozen=True)
class Adjustment:
    """A change of the whole instead of one requirement."""

    change: Change
    points: Decimal
    why: str
    by: str

    def __str__(self) -> str:
        words = {
            Change.POINTS: f"{self.points:+f} points",
            Change.TOTAL: f"total of {self.points:f} points",
            Change.BONUS: f"bonus of {self.points:f} points",
        }
        return f"{words[self.change]} by {self.by} ({self.why})"


@dataclass(frozen=True)
class SubmissionDecision:
    """What people have decided about one submission."""

    points: tuple[PointsOverride, ...] = ()
    adjustments: tuple[Adjustment, ...] = ()
    comments: tuple[str, ...] = ()
    submitted: dt.datetime | None = None
    flags_accepted: Accepted | None = None
    package: str = ""
    """Which package is graded, by its path in the submission, instead of the grader's choice."""
    people: tuple[Person, ...] | None = None
    """Whose it is, instead of whom the export was matched with; None if that was not decided."""


@dataclass(frozen=True)
class PersonDecision:
    """What people have decided about one student."""

    excused: Excuse | None = None
    extension: Extension | None = None
    adjustments: tuple[Adjustment, ...] = ()
    comments: tuple[str, ...] = ()


@dataclass(frozen=True)
class Decisions:
    """All decisions, by submission id and by Person.key."""

    submissions: Mapping[str, SubmissionDecision] = field(default_factory=dict)
    people: Mapping[tuple[str, str], PersonDecision] = field(default_factory=dict)

    def on(self, submission: str) -> SubmissionDecision:
        """Return the decisions on a submission."""
        return self.submissions.get(submission, SubmissionDecision())

    def about(self, person: Person) -> PersonDecision:
        """Return the decisions about a student."""
        return self.people.get(person.key, PersonDecision())


def load(path: Path, submissions: Iterable[str], people: Sequence[Person], rubric: Rubric) -> Decisions:
    """Return the decisions in `path`, none if there is no such file.

    Raises:
        GraderError: it cannot be read, or names something that the class or the rubric does not have.
    """
    root = yaml_reader.read(path) if path.exists() else None
    return _Reader(path, tuple(submissions), people, rubric).read(root)


def of_class(folder: ClassFolder, facts: ClassFacts, rubric: Rubric) -> Decisions:
    """Return what the class's overrides.yaml says.

    Raises:
        GraderError: as `load`.
    """
    everyone = [*dict.fromkeys(person for entry in facts.entries for person in entry.people), *facts.missing]
    return load(folder.overrides, [entry.id for entry in facts.entries], everyone, rubric)


def applied(facts: ClassFacts, decisions: Decisions) -> ClassFacts:
    """Return the facts with each submission given to whom a person assigned it; what that decides is no doubt any more.

    class.yaml keeps what was found, so that a decision can be taken back.
    """
    assigned = {name: on.people for name, on in decisions.submissions.items() if on.people is not None}
    entries = tuple(
        replace(entry, people=people, matched=(Claim("overrides", "overrides.yaml"),) * len(people))
        if (people := assigned.get(entry.id)) is not None
        else entry
        for entry in facts.entries
    )
    everyone = dict.fromkeys([*(who for entry in facts.entries for who in entry.people), *facts.missing])
    handed_in = {who.key for entry in entries for who in entry.people}
    whose = (DoubtKind.UNMATCHED, DoubtKind.AMBIGUOUS)
    doubts = tuple(doubt for doubt in facts.doubts if doubt.kind not in whose or doubt.entry not in assigned)
    if not too_many([entry for entry in entries if not entry.people and entry.id not in assigned], entries):
        doubts = tuple(doubt for doubt in doubts if doubt.kind is not DoubtKind.MOST_UNMATCHED)
    doubts = tuple(each for doubt in doubts if (each := _undecided(doubt, decisions)))
    missing = tuple(who for who in everyone if who.key not in handed_in)
    return replace(facts, entries=entries, missing=missing, doubts=doubts)


def _undecided(doubt: Doubt, decisions: Decisions) -> Doubt | None:
    """Return a doubt without those to whom a person gave a total or an excuse; None if it was about nobody else."""
    if doubt.kind is not DoubtKind.LOST or not doubt.people:
        return doubt
    about = {who: decisions.about(who) for who in doubt.people}
    left = tuple(
        who
        for who, on in about.items()
        if not on.excused and all(each.change is not Change.TOTAL for each in on.adjustments)
    )
    return replace(doubt, people=left) if left else None


class _Reader(YamlReader):
    def __init__(self, path: Path, submissions: Sequence[str], people: Sequence[Person], rubric: Rubric) -> None:
        super().__init__(path)
        self._submissions = submissions
        self._rubric = rubric
        self._people = people
        self._names = {getattr(person, kind) for person in people for kind in (*IDENTITY, "name")} - {""}

    def read(self, root: yaml.Node | None) -> Decisions:
        if root is None:
            return Decisions()
        submissions: dict[str, SubmissionDecision] = {}
        about: dict[tuple[str, str], PersonDecision] = {}
        for key, node, value in self.mapping(root, ("submissions", "people")):
            del node
            for name, where, decided in self.mapping(value):
                if key == "submissions":
                    self.require_known(name, where, self._submissions, "a submission of this class")
                    submissions[name] = self._submission(decided)
                else:
                    about[self._person_named(name, where).key] = self._person(decided)
        return Decisions(submissions, about)

    def _person_named(self, name: str, where: yaml.Node) -> Person:
        found = identify([Claim(ANY, name)], self._people)
        if not found.people and not found.why:
            self.require_known(name, where, self._names, "a person of this class")
        if not found.people:
            names = " or ".join(f"{value} ({kind})" for kind, value in (person.key for person in found.rivals))
            several = f"is {len(found.rivals)} people of this class" if found.rivals[1:] else f"is nobody: {found.why}"
            self.fail(where, f"{name} {several}; write {names}")
        return found.people[0]

    def _submission(self, node: yaml.Node) -> SubmissionDecision:
        points: list[PointsOverride] = []
        adjustments: list[Adjustment] = []
        comments: tuple[str, ...] = ()
        submitted, people, accepted, package = None, None, None, ""
        known = ("points", "adjust", "bonus", "flags_accepted", "comments", "submitted", "package", "people")
        for key, where, value in self.mapping(node, known):
            if key == "points":
                points = [self._points(name, where, given) for name, where, given in self.mapping(value)]
            elif key == "comments":
                comments = self._texts(value)
            elif key == "submitted":
                submitted = self._time(value)
            elif key == "package":
                package = self.text(value)
            elif key == "flags_accepted":
                accepted = Accepted(**self._why_and_by(value, where))
            elif key == "people":
                nodes = value.value if isinstance(value, yaml.SequenceNode) else [value]
                people = tuple(self._person_named(self.text(each), each) for each in nodes)
            else:
                adjustments.append(self._adjustment(key, where, value))
        return SubmissionDecision(tuple(points), tuple(adjustments), comments, submitted, accepted, package, people)

    def _person(self, node: yaml.Node) -> PersonDecision:
        excused: Excuse | None = None
        extension: Extension | None = None
        adjustments: list[Adjustment] = []
        comments: tuple[str, ...] = ()
        for key, where, value in self.mapping(node, ("excused", "extension", "adjust", "bonus", "comments")):
            if key == "comments":
                comments = self._texts(value)
            elif key in ("adjust", "bonus"):
                adjustments.append(self._adjustment(key, where, value))
            elif key == "excused":
                excused = Excuse(**self._why_and_by(value, where))
            else:
                given = self.fields(value, where, ("until", "why", "by"), "a decision")
                extension = Extension(self._time(given["until"]), self.text(given["why"]), self.text(given["by"]))
        return PersonDecision(excused, extension, tuple(adjustments), comments)

    def _why_and_by(self, node: yaml.Node, where: yaml.Node) -> dict[str, str]:
        return {name: self.text(said) for name, said in self.fields(node, where, ("why", "by"), "a decision").items()}

    def _adjustment(self, key: str, where: yaml.Node, node: yaml.Node) -> Adjustment:
        given = self.fields(node, where, ("why", "by"), "a decision", ("points", "total"))
        kinds = [kind for kind in ("points", "total") if kind in given]
        allowed = ("points",) if key == "bonus" else ("points", "total")
        if len(kinds) != 1 or kinds[0] not in allowed:
            self.fail(where, f"{key} needs {' or '.join(allowed)}, why, by")
        most = sum(r.points for r in self._rubric.requirements) if kinds[0] == "total" else None
        value = self.points(given[kinds[0]], most, "the rubric")
        if key == "bonus" and value < 0:
            self.fail(given["points"], f"a bonus of {value} points is none; `adjust` subtracts points")
        change = Change.BONUS if key == "bonus" else Change(kinds[0])
        return Adjustment(change, value, self.text(given["why"]), self.text(given["by"]))

    def _points(self, name: str, where: yaml.Node, node: yaml.Node) -> PointsOverride:
        worth = {requirement.id: requirement.points for requirement in self._rubric.requirements}
        self.require_known(name, where, worth, "a requirement of the rubric")
        given = self.fields(node, where, ("points", "why", "by"), "a decision")
        value = self.points(given["points"], worth[name], name)
        return PointsOverride(name, value, self.text(given["why"]), self.text(given["by"]))

    def _texts(self, node: yaml.Node) -> tuple[str, ...]:
        if isinstance(node, yaml.SequenceNode):
            return tuple(self.text(item) for item in node.value)
        return (self.text(node),)

    def _time(self, node: yaml.Node) -> dt.datetime:
        if (time := local_time(self.text(node))) is None:
            self.fail(node, f"{self.text(node)} is not a time; write it as 2026-11-21T10:00")
        return time
