"""Read rubric.yaml: criteria, requirements, checks. Pure: no judging, no printing."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from grader.errors import GraderError


@dataclass(frozen=True)
class Check:
    """One check and the points that hang on it. `id` is "module::function" below grader/checks."""

    id: str
    points: float
    level: str


@dataclass(frozen=True)
class Requirement:
    """One requirement of the contract. Without checks it is not graded yet."""

    id: str
    criterion: str
    points: float
    text: str
    section: str
    checks: tuple[Check, ...]

    @property
    def level(self) -> str:
        """Return "core", "advanced", or both with their points."""
        points = {level: sum(c.points for c in self.checks if c.level == level) for level in ("core", "advanced")}
        if not self.checks or not points["advanced"]:
            return "core"
        return " + ".join(f"{level} {value:g}" for level, value in points.items() if value)


@dataclass(frozen=True)
class Criterion:
    """One criterion with its requirements, and the words for each level A to D."""

    id: str
    title: str
    points: float
    levels: dict[str, str]
    requirements: tuple[Requirement, ...]


@dataclass(frozen=True)
class Rubric:
    """The whole rubric."""

    title: str
    version: str
    criteria: tuple[Criterion, ...]

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
            KeyError: there is none of that name.
        """
        for requirement in self.requirements:
            if requirement.id == name:
                return requirement
        raise KeyError(name)


def load(path: Path) -> Rubric:
    """Return the rubric in `path`.

    Raises:
        GraderError: the file cannot be read, or its points do not add up.
    """
    try:
        data = yaml.safe_load(path.read_text())
        rubric = _rubric(data)
    except (OSError, yaml.YAMLError, KeyError, TypeError, AttributeError) as error:
        raise GraderError(f"{path} cannot be read as a rubric ({error!r}). Compare it with the kit's own.") from error
    problems = _problems(rubric)
    if problems:
        raise GraderError(f"{path} does not add up: {'; '.join(problems)}. Mend the points and run again.")
    return rubric


def _rubric(data: dict[str, Any]) -> Rubric:
    return Rubric(
        title=data["title"], version=str(data["version"]), criteria=tuple(_criterion(c) for c in data["criteria"])
    )


def _criterion(data: dict[str, Any]) -> Criterion:
    return Criterion(
        id=data["id"],
        title=data["title"],
        points=float(data["points"]),
        levels=dict(data["levels"]),
        requirements=tuple(_requirement(r, data["id"]) for r in data["requirements"]),
    )


def _requirement(data: dict[str, Any], criterion: str) -> Requirement:
    return Requirement(
        id=data["id"],
        criterion=criterion,
        points=float(data["points"]),
        text=" ".join(data["text"].split()),
        section=data["section"],
        checks=tuple(Check(c["id"], float(c["points"]), c.get("level", "core")) for c in data.get("checks", ())),
    )


def _problems(rubric: Rubric) -> list[str]:
    problems = []
    for criterion in rubric.criteria:
        total = sum(r.points for r in criterion.requirements)
        if abs(total - criterion.points) > 1e-9:
            problems.append(f"{criterion.id} has {criterion.points:g} points, its requirements {total:g}")
    for requirement in rubric.requirements:
        total = sum(check.points for check in requirement.checks)
        if requirement.checks and abs(total - requirement.points) > 1e-9:
            problems.append(f"{requirement.id} has {requirement.points:g} points, its checks {total:g}")
    ids = [check.id for check in rubric.checks] + [requirement.id for requirement in rubric.requirements]
    problems += [f"{name} is listed twice" for name in sorted({name for name in ids if ids.count(name) > 1})]
    return problems
