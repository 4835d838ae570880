"""Read overrides.yaml: what people have decided about a class. Every mistake in it is named with its line.

    submissions:
      team07:
        points:
          F4: {points: 3, why: "the wall stood in the start", by: "A. Lovelace"}
        comments: ["A fine README."]
        submitted: 2026-11-21T10:00
    people:
      s1234:
        extension: {until: 2026-11-25T23:59, why: "ill", by: "A. Lovelace"}
      s1235:
        excused: {why: "passed last year", by: "A. Lovelace"}

The kit never writes this file.
"""

from __future__ import annotations

import datetime as dt
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from decimal import Decimal
from pathlib import Path

import yaml

from grader import yaml_reader
from grader.classroom import regrades
from grader.classroom.class_folder import ClassFacts, ClassFolder
from grader.classroom.regrades import Regrade
from grader.classroom.roster import IDENTITY, Person
from grader.errors import GraderError
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


@dataclass(frozen=True)
class SubmissionDecision:
    """What people have decided about one submission."""

    points: tuple[PointsOverride, ...] = ()
    comments: tuple[str, ...] = ()
    submitted: dt.datetime | None = None


@dataclass(frozen=True)
class PersonDecision:
    """What people have decided about one student."""

    excused: Excuse | None = None
    extension: Extension | None = None
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
    if not path.exists():
        return Decisions()
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise GraderError(f"{path} cannot be read ({error}).") from error
    root = yaml_reader.compose(path, text)
    return _Reader(path, tuple(submissions), people, rubric).read(root)


def of_class(folder: ClassFolder, facts: ClassFacts, rubric: Rubric) -> Decisions:
    """Return the decisions about a class, those on requests to look again among them.

    Raises:
        GraderError: as `load`.
    """
    looked_at = regrades.read(folder.path, [entry.id for entry in facts.entries], rubric)
    return _with(written(folder, facts, rubric), looked_at)


def written(folder: ClassFolder, facts: ClassFacts, rubric: Rubric) -> Decisions:
    """Return what the class's overrides.yaml says.

    Raises:
        GraderError: as `load`.
    """
    everyone = [*dict.fromkeys(person for entry in facts.entries for person in entry.people), *facts.missing]
    return load(folder.overrides, [entry.id for entry in facts.entries], everyone, rubric)


def _with(decided: Decisions, looked_at: Iterable[Regrade]) -> Decisions:
    """Return the decisions with those on requests; what overrides.yaml says of a requirement stays."""
    submissions = dict(decided.submissions)
    for each in looked_at:
        on = submissions.get(each.submission, SubmissionDecision())
        known = {override.requirement for override in on.points}
        if each.points is not None and each.requirement not in known:
            why = f"{each.why}; asked because: {each.reason}" if each.reason else each.why
            on = replace(on, points=(*on.points, PointsOverride(each.requirement, each.points, why, each.by)))
        elif each.points is None:
            on = replace(on, comments=(*on.comments, str(each)))
        submissions[each.submission] = on
    return replace(decided, submissions=submissions)


class _Reader(YamlReader):
    def __init__(self, path: Path, submissions: Sequence[str], people: Sequence[Person], rubric: Rubric) -> None:
        super().__init__(path)
        self._submissions = submissions
        self._rubric = rubric
        self._named: dict[str, list[Person]] = {}
        for person in people:
            for name in {getattr(person, kind) for kind in (*IDENTITY, "name")} - {""}:
                self._named.setdefault(name, []).append(person)

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
                    self.require_known(name, where, self._named, "a person of this class")
                    about[self._one_person(name, where).key] = self._person(decided)
        return Decisions(submissions, about)

    def _one_person(self, name: str, where: yaml.Node) -> Person:
        people = self._named[name]
        if len(people) > 1:
            names = " or ".join(f"{value} ({kind})" for kind, value in (person.key for person in people))
            self.fail(where, f"{name} is {len(people)} people of this class; write {names}")
        return people[0]

    def _submission(self, node: yaml.Node) -> SubmissionDecision:
        points: list[PointsOverride] = []
        comments: tuple[str, ...] = ()
        submitted = None
        for key, _, value in self.mapping(node, ("points", "comments", "submitted")):
            if key == "points":
                points = [self._points(name, where, given) for name, where, given in self.mapping(value)]
            elif key == "comments":
                comments = self._texts(value)
            else:
                submitted = self._time(value)
        return SubmissionDecision(tuple(points), comments, submitted)

    def _person(self, node: yaml.Node) -> PersonDecision:
        excused: Excuse | None = None
        extension: Extension | None = None
        comments: tuple[str, ...] = ()
        for key, where, value in self.mapping(node, ("excused", "extension", "comments")):
            if key == "comments":
                comments = self._texts(value)
            elif key == "excused":
                given = self.fields(value, where, ("why", "by"), "a decision")
                excused = Excuse(self.text(given["why"]), self.text(given["by"]))
            else:
                given = self.fields(value, where, ("until", "why", "by"), "a decision")
                extension = Extension(self._time(given["until"]), self.text(given["why"]), self.text(given["by"]))
        return PersonDecision(excused, extension, comments)

    def _points(self, name: str, where: yaml.Node, node: yaml.Node) -> PointsOverride:
        worth = {requirement.id: requirement.points for requirement in self._rubric.requirements}
        self.require_known(name, where, worth, "a requirement of the rubric")
        given = self.fields(node, where, ("points", "why", "by"), "a decision")
        text = self.text(given["points"])
        try:
            value = Decimal(text)
        except ArithmeticError:
            self.fail(given["points"], f"{text} is not a number of points")
        if not 0 <= value <= Decimal(str(worth[name])):  # also refuses NaN, which compares False
            self.fail(given["points"], f"{name} has {worth[name]:g} points; {text} is outside 0 to {worth[name]:g}")
        return PointsOverride(name, value, self.text(given["why"]), self.text(given["by"]))

    def _texts(self, node: yaml.Node) -> tuple[str, ...]:
        if isinstance(node, yaml.SequenceNode):
            return tuple(self.text(item) for item in node.value)
        return (self.text(node),)

    def _time(self, node: yaml.Node) -> dt.datetime:
        text = self.text(node)
        try:
            time = dt.datetime.fromisoformat(text)
        except ValueError:
            self.fail(node, f"{text} is not a time; write it as 2026-11-21T10:00")
        return time if time.tzinfo else time.astimezone()
