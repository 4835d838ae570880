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
import difflib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from decimal import Decimal
from pathlib import Path
from typing import NoReturn

import yaml

from grader.classroom.class_folder import ClassFacts, ClassFolder
from grader.classroom.roster import Person
from grader.errors import GraderError
from grader.scoring.rubric import Rubric


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
    people: Mapping[str, PersonDecision] = field(default_factory=dict)

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
        root = yaml.compose(path.read_text(encoding="utf-8"), yaml.SafeLoader)
    except (OSError, UnicodeDecodeError) as error:
        raise GraderError(f"{path} cannot be read ({error}).") from error
    except yaml.MarkedYAMLError as error:
        line = error.problem_mark.line + 1 if error.problem_mark else "?"
        raise GraderError(f"{path}, line {line}: {error.problem}. Correct the YAML and run again.") from error
    return _Reader(path, tuple(submissions), people, rubric).read(root)


def of_class(folder: ClassFolder, facts: ClassFacts, rubric: Rubric) -> Decisions:
    """Return the decisions about a class.

    Raises:
        GraderError: as `load`.
    """
    everyone = [*dict.fromkeys(person for entry in facts.entries for person in entry.people), *facts.missing]
    return load(folder.overrides, [entry.id for entry in facts.entries], everyone, rubric)


class _Reader:
    """Walks the nodes of the file, which know their lines."""

    def __init__(self, path: Path, submissions: Sequence[str], people: Sequence[Person], rubric: Rubric) -> None:
        self._path = path
        self._submissions = submissions
        self._rubric = rubric
        self._keys: dict[str, str] = {}
        for person in people:
            for name in (person.id, person.login, person.email, person.name):
                if name:
                    self._keys.setdefault(name, person.key)

    def read(self, root: yaml.Node | None) -> Decisions:
        if root is None:
            return Decisions()
        submissions: dict[str, SubmissionDecision] = {}
        about: dict[str, PersonDecision] = {}
        for key, node, value in self._mapping(root, ("submissions", "people")):
            del node
            for name, where, decided in self._mapping(value):
                if key == "submissions":
                    self._known(name, where, self._submissions, "a submission of this class")
                    submissions[name] = self._submission(decided)
                else:
                    self._known(name, where, self._keys, "a person of this class")
                    about[self._keys[name]] = self._person(decided)
        return Decisions(submissions, about)

    def _submission(self, node: yaml.Node) -> SubmissionDecision:
        points: list[PointsOverride] = []
        comments: tuple[str, ...] = ()
        submitted = None
        for key, _, value in self._mapping(node, ("points", "comments", "submitted")):
            if key == "points":
                points = [self._points(name, where, given) for name, where, given in self._mapping(value)]
            elif key == "comments":
                comments = self._texts(value)
            else:
                submitted = self._time(value)
        return SubmissionDecision(tuple(points), comments, submitted)

    def _person(self, node: yaml.Node) -> PersonDecision:
        excused: Excuse | None = None
        extension: Extension | None = None
        comments: tuple[str, ...] = ()
        for key, where, value in self._mapping(node, ("excused", "extension", "comments")):
            if key == "comments":
                comments = self._texts(value)
            elif key == "excused":
                given = self._fields(value, where, ("why", "by"))
                excused = Excuse(self._text(given["why"]), self._text(given["by"]))
            else:
                given = self._fields(value, where, ("until", "why", "by"))
                extension = Extension(self._time(given["until"]), self._text(given["why"]), self._text(given["by"]))
        return PersonDecision(excused, extension, comments)

    def _points(self, name: str, where: yaml.Node, node: yaml.Node) -> PointsOverride:
        worth = {requirement.id: requirement.points for requirement in self._rubric.requirements}
        self._known(name, where, worth, "a requirement of the rubric")
        given = self._fields(node, where, ("points", "why", "by"))
        text = self._text(given["points"])
        try:
            value = Decimal(text)
        except ArithmeticError:
            self._fail(given["points"], f"{text} is not a number of points")
        if not 0 <= value <= Decimal(str(worth[name])):  # also refuses NaN, which compares False
            self._fail(given["points"], f"{name} has {worth[name]:g} points; {text} is outside 0 to {worth[name]:g}")
        return PointsOverride(name, value, self._text(given["why"]), self._text(given["by"]))

    def _fields(self, node: yaml.Node, where: yaml.Node, names: tuple[str, ...]) -> dict[str, yaml.Node]:
        """Return all the named fields of a mapping; every one of them is needed."""
        found = {key: value for key, _, value in self._mapping(node, names)}
        for name in names:
            if name not in found:
                self._fail(where, f"{name!r} is missing; a decision needs {', '.join(names)}")
        return found

    def _mapping(self, node: yaml.Node, allowed: tuple[str, ...] = ()) -> Iterator[tuple[str, yaml.Node, yaml.Node]]:
        """Return a mapping's keys as text, their nodes and their values."""
        if isinstance(node, yaml.ScalarNode) and node.value in ("", "null", "~"):
            return
        if not isinstance(node, yaml.MappingNode):
            self._fail(node, "a mapping is expected here, such as `name: value`")
        seen: set[str] = set()
        for key, value in node.value:
            name = self._text(key)
            if allowed:
                self._known(name, key, allowed, "allowed here")
            if name in seen:
                self._fail(key, f"{name} is written twice; join the two")
            seen.add(name)
            yield name, key, value

    def _texts(self, node: yaml.Node) -> tuple[str, ...]:
        if isinstance(node, yaml.SequenceNode):
            return tuple(self._text(item) for item in node.value)
        return (self._text(node),)

    def _text(self, node: yaml.Node) -> str:
        if not isinstance(node, yaml.ScalarNode):
            self._fail(node, "a plain text or number is expected here")
        return str(node.value)

    def _time(self, node: yaml.Node) -> dt.datetime:
        text = self._text(node)
        try:
            time = dt.datetime.fromisoformat(text)
        except ValueError:
            self._fail(node, f"{text} is not a time; write it as 2026-11-21T10:00")
        return time if time.tzinfo else time.astimezone()

    def _known(self, name: str, node: yaml.Node, known: Iterable[str], what: str) -> None:
        known = list(known)
        if name not in known:
            near = difflib.get_close_matches(name, known, 1, 0.4)
            hint = f"Did you mean {near[0]}?" if near else f"There are: {', '.join(known[:10])}."
            self._fail(node, f"{name} is not {what}. {hint}")

    def _fail(self, node: yaml.Node, problem: str) -> NoReturn:
        raise GraderError(f"{self._path}, line {node.start_mark.line + 1}: {problem}")
