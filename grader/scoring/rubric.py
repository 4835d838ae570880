"""Read rubric.yaml: criteria, requirements, checks. Pure: no judging, no printing."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import yaml

from grader import KIT, yaml_reader
from grader.words import say, spoken
from grader.yaml_reader import YamlReader, line_of

RUBRIC = KIT / "rubric.yaml"
"""The kit's own rubric."""
HUNT = "check_hunt::test_keeps_its_promises"
"""The check that judges a hunt; for each requirement it is another, with the requirement's id in brackets."""
FLAGS = ("note", "withhold")
"""What integrity flags do by a rubric: nothing to the points, or keep what they concern until a person decides."""
_TRUE = ("true", "false")


@dataclass(frozen=True)
class Check:
    """One check and its points. `id` is "module::function", of the course's checks or of those in grader/checks."""

    id: str
    points: float
    level: str = "core"

    @property
    def module(self) -> str:
        """Return the name of the module that it is in."""
        return self.id.partition("::")[0]


@dataclass(frozen=True)
class Requirement:
    """One requirement of the contract. `advanced` of its `points` are advanced; without checks a person grades it.

    Its `section`, "notebook#heading", is where the course teaches it, "" if no notebook does.
    Its `hunt` is in how many made-up cases it is hunted for a broken promise, 0 if it is not.
    What judges one that is `held_back` is not for students to see; their kit's rubric has no checks of it.
    """

    id: str
    criterion: str
    points: float
    text: str
    section: str
    checks: tuple[Check, ...]
    advanced: float = 0.0
    title: str = ""
    held_back: bool = False
    hunt: int = 0

    @property
    def can_be_checked(self) -> bool:
        """Return whether `check` can judge it: nothing that is held back gets into a notebook's output."""
        return bool(self.checks) and not self.held_back

    @property
    def waits(self) -> str:
        """Return what happens to it where it has no checks."""
        return say("judged at hand-in") if self.held_back else say("to be graded by a person")

    @property
    def level(self) -> str:
        """Return "core", "advanced", or both with their points: "core 1 + advanced 1"."""
        points = {"core": self.points - self.advanced, "advanced": self.advanced}
        held = {level: value for level, value in points.items() if value > 0}
        return next(iter(held), "core") if len(held) < 2 else " + ".join(f"{k} {v:g}" for k, v in held.items())


@dataclass(frozen=True)
class Criterion:
    """One criterion with its requirements, and the words for each level A to D."""

    id: str
    title: str
    points: float
    levels: dict[str, str]
    requirements: tuple[Requirement, ...]

    @property
    def span(self) -> str:
        """Return its first and last requirement, "Q1 to Q6"; "" if it has none."""
        ends = (*self.requirements[:1], *self.requirements[-1:])
        return say(" to ").join(dict.fromkeys(requirement.id for requirement in ends))


@dataclass(frozen=True)
class Step:
    """One step of a grading scale: the grade for at least so many percent of the points."""

    grade: str
    percent: float


@dataclass(frozen=True)
class Figure:
    """A figure that checks measure. Of submissions with the same points it ranks the one with the `most` or the least.

    `unit` is for people.
    """

    name: str
    unit: str
    most: bool


@dataclass(frozen=True)
class Rubric:
    """The whole rubric. `scale`, from the best grade to that for no points, may be empty. `sha256` is of its text.

    `league` are the figures by which a class is ranked after the points, the weightiest first; most have none.
    `dropped` are ids that it has not, and that the course's notebooks may ask for. If it `withholds`, the points of
    requirements that an integrity flag concerns wait for a person.
    """

    title: str
    version: str
    criteria: tuple[Criterion, ...]
    scale: tuple[Step, ...] = ()
    league: tuple[Figure, ...] = ()
    sha256: str = ""
    dropped: tuple[str, ...] = ()
    withholds: bool = False

    def grade(self, points: float) -> str:
        """Return the grade for a total, "" without a scale."""
        worth = sum(requirement.points for requirement in self.requirements)
        return next((step.grade for step in self.scale if points >= step.percent * worth / 100 - 1e-9), "")

    @property
    def requirements(self) -> tuple[Requirement, ...]:
        """Return every requirement, in the rubric's order."""
        return tuple(requirement for criterion in self.criteria for requirement in criterion.requirements)

    @property
    def checks(self) -> tuple[Check, ...]:
        """Return every check, in the rubric's order."""
        return tuple(check for requirement in self.requirements for check in requirement.checks)

    def requirement(self, name: str) -> Requirement:
        """Return the requirement `name`, such as "F4".

        Raises:
            KeyError: there is no such requirement.
        """
        return {requirement.id: requirement for requirement in self.requirements}[name]


def load(path: Path, checks: Collection[str] | None = None) -> Rubric:
    """Return the rubric in `path`. `checks` are the ids that there are; None: any. Points that are not typed are sums.

    Raises:
        GraderError: the file cannot be read, names something unknown, or its points do not add up.
    """
    text = yaml_reader.text(path, "Compare it with the kit's own.")
    return _loaded(path, text, None if checks is None else frozenset(checks), spoken())


@lru_cache(32)
def _loaded(path: Path, read: str, checks: frozenset[str] | None, _language: str) -> Rubric:
    """Return the rubric in `path` with the text `read`, in the language in use. Reading one takes 10 ms."""
    return replace(
        _Reader(checks).rubric(yaml_reader.compose(path, read)), sha256=hashlib.sha256(read.encode()).hexdigest()
    )


class _Reader(YamlReader):
    """Makes the parts of a rubric."""

    def __init__(self, checks: Collection[str] | None) -> None:
        self._checks = checks
        self._lines: dict[str, int] = {}

    def rubric(self, node: yaml.Node) -> Rubric:
        optional = ("scale", "league", "dropped", "flags")
        given = self.fields(node, node, ("title", "version", "criteria"), "a rubric", optional)
        criteria = self.every(given["criteria"], self._criterion)
        scale = self._scale(given["scale"]) if "scale" in given else ()
        league = self.every(given["league"], self._figure) if "league" in given else ()
        dropped = self.texts(given["dropped"]) if "dropped" in given else ()
        withholds = "flags" in given and self.one_of(given["flags"], FLAGS, "a value of `flags`") == FLAGS[1]
        title, version = self._said(given["title"]), self.text(given["version"])
        return Rubric(title, version, criteria, scale, league, dropped=dropped, withholds=withholds)

    def _scale(self, node: yaml.Node) -> tuple[Step, ...]:
        items = self.items(node)
        steps = [self.record(Step, item, "a step of the scale", percent=self._points) for item in items]
        for item, before, step in zip(items[1:], steps, steps[1:], strict=False):
            if step.percent >= before.percent:
                self.fail(item, f"{step.grade} needs less than the {before.percent:g} percent of the step before")
        if not steps or steps[-1].percent != 0:
            self.fail(node, "a scale ends with the grade for 0 percent, so that every total has one")
        return tuple(steps)

    def _figure(self, node: yaml.Node) -> Figure:
        given = self.fields(node, node, ("figure", "unit", "best"), "a figure of the league")
        most = self.one_of(given["best"], ("most", "least"), "a value of `best`") == "most"
        return Figure(self.text(given["figure"]), self.text(given["unit"]), most)

    def _criterion(self, node: yaml.Node) -> Criterion:
        given = self.fields(node, node, ("id", "title", "levels", "requirements"), "a criterion", ("points",))
        name = self._id(given["id"])
        requirements = self.every(given["requirements"], lambda item: self._requirement(item, name))
        levels = self.fields(given["levels"], given["levels"], ("A", "B", "C", "D"), "a criterion")
        return Criterion(
            id=name,
            title=self._said(given["title"]),
            points=self._sum(requirements, given, "points, its requirements"),
            levels={level: self._said(words) for level, words in levels.items()},
            requirements=requirements,
        )

    def _requirement(self, node: yaml.Node, criterion: str) -> Requirement:
        needed, optional = ("id", "text"), ("section", "points", "title", "advanced", "checks", "held_back", "hunt")
        given = self.fields(node, node, needed, "a requirement", optional)
        name = self._id(given["id"])
        checks = self.every(given["checks"], self._check) if "checks" in given else ()
        held_back = "held_back" in given and self.one_of(given["held_back"], _TRUE, "a value of `held_back`") == "true"
        hunt = 0
        if "hunt" in given and held_back:
            self.fail(given["hunt"], f"{name} is held back, and students have the promises that a hunt is about")
        if "hunt" in given:
            hunt, check = self._hunt(given["hunt"], name)
            checks = (*checks, check)
        if not checks and "points" not in given:
            self.fail(node, f"{name} has no checks to sum its points from; write its `points`")
        advanced = [check for check in checks if check.level == "advanced"] if checks else None
        return Requirement(
            id=name,
            criterion=criterion,
            points=self._sum(checks or None, given, "points, its checks"),
            text=self._said(given["text"]),
            section=self.text(given["section"]) if "section" in given else "",
            checks=checks,
            advanced=self._sum(advanced, given, "advanced points, its checks", "advanced"),
            title=self._said(given["title"]) if "title" in given else name,
            held_back=held_back,
            hunt=hunt,
        )

    def _said(self, node: yaml.Node) -> str:
        """Return a text in the language in use."""
        return say(" ".join(self.text(node).split()))

    def _check(self, node: yaml.Node) -> Check:
        return self.record(Check, node, "a check", id=self._check_id, points=self._points, level=self._level)

    def _check_id(self, node: yaml.Node) -> str:
        name = self._id(node)
        if name == HUNT:
            self.fail(node, "write `hunt: {cases: 300, points: 2}` beside `checks` instead")
        if self._checks is not None and name not in self._checks:
            module = name.partition("::")[0]
            same = [each for each in self._checks if each.partition("::")[0] == module]
            self.require_known(name, node, sorted(same or self._checks), "a check of the kit")
        return name

    def _hunt(self, node: yaml.Node, requirement: str) -> tuple[int, Check]:
        """Return the number of cases of a hunt, and the check that gives all of its points or none."""
        given = self.fields(node, node, ("cases", "points"), "a hunt", ("level",))
        if not (cases := self.text(given["cases"])).isdecimal() or int(cases) < 1:
            self.fail(given["cases"], f"{cases} is not a number of cases")
        level = self._level(given["level"]) if "level" in given else "core"
        return int(cases), Check(f"{HUNT}[{requirement}]", self._points(given["points"]), level)

    def _level(self, node: yaml.Node) -> str:
        return self.one_of(node, ("core", "advanced"), "a level")

    def _id(self, node: yaml.Node) -> str:
        name = self.text(node)
        if name in self._lines:
            self.fail(node, f"{name} is listed twice, first in line {self._lines[name]}")
        self._lines[name] = line_of(node)
        return name

    def _points(self, node: yaml.Node) -> float:
        points = float(self.points(node))
        if points < 0:
            self.fail(node, f"{points:g} is not a number of points")
        return points

    def _sum(
        self, parts: Sequence[Check | Requirement] | None, given: dict[str, yaml.Node], what: str, key: str = "points"
    ) -> float:
        """Return the points of all parts, which those that are written have to be; of None whatever is written."""
        total = round(math.fsum(part.points for part in parts or ()), 9)
        if key not in given:
            return total
        points = self._points(given[key])
        if parts is not None and abs(total - points) > 1e-9:
            self.fail(given[key], f"{self.text(given['id'])} has {points:g} {what} {total:g}; correct the points")
        return points
