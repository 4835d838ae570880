"""Read rubric.yaml: criteria, requirements, checks. Pure: no judging, no printing."""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import yaml

from grader import KIT
from grader.errors import GraderError

RUBRIC = KIT / "rubric.yaml"
"""The kit's own rubric."""


@dataclass(frozen=True)
class Check:
    """One check and its points. `id` is "module::function" in grader/checks."""

    id: str
    points: float
    level: str


@dataclass(frozen=True)
class Requirement:
    """One requirement of the contract. `advanced` of its `points` are advanced; without checks a person grades it."""

    id: str
    criterion: str
    points: float
    text: str
    section: str
    checks: tuple[Check, ...]
    advanced: float = 0.0
    title: str = ""

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


@dataclass(frozen=True)
class Rubric:
    """The whole rubric. `sha256` is that of its file."""

    title: str
    version: str
    criteria: tuple[Criterion, ...]
    sha256: str = ""

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
        content = path.read_bytes()
        rubric = replace(_rubric(yaml.safe_load(content)), sha256=hashlib.sha256(content).hexdigest())
    except (OSError, yaml.YAMLError, KeyError, TypeError, AttributeError, ValueError) as error:
        raise GraderError(f"{path} cannot be read as a rubric ({error!r}). Compare it with the kit's own.") from error
    problems = _problems(rubric)
    if problems:
        raise GraderError(f"{path} does not add up: {'; '.join(problems)}. Fix the points and run again.")
    return rubric


def _known(data: dict[str, Any], keys: str) -> dict[str, Any]:
    """Return `data` if all its keys are in `keys`: a misspelt "checks" would silently leave a requirement ungraded."""
    unknown = sorted(str(key) for key in set(data) - set(keys.split()))
    if unknown:
        raise KeyError(f"{data.get('id', 'the rubric')} has the unknown key {', '.join(unknown)}")
    return data


def _rubric(data: dict[str, Any]) -> Rubric:
    _known(data, "title version criteria")
    return Rubric(
        title=data["title"], version=str(data["version"]), criteria=tuple(_criterion(c) for c in data["criteria"])
    )


def _criterion(data: dict[str, Any]) -> Criterion:
    _known(data, "id title points levels requirements")
    return Criterion(
        id=data["id"],
        title=data["title"],
        points=float(data["points"]),
        levels=dict(data["levels"]),
        requirements=tuple(_requirement(r, data["id"]) for r in data["requirements"]),
    )


def _requirement(data: dict[str, Any], criterion: str) -> Requirement:
    _known(data, "id title points advanced text section checks")
    return Requirement(
        id=data["id"],
        criterion=criterion,
        points=float(data["points"]),
        text=" ".join(data["text"].split()),
        section=data["section"],
        checks=tuple(_check(c) for c in data.get("checks", ())),
        advanced=float(data.get("advanced", 0)),
        title=data.get("title", data["id"]),
    )


def _check(data: dict[str, Any]) -> Check:
    _known(data, "id points level")
    return Check(id=data["id"], points=float(data["points"]), level=data.get("level", "core"))


def _problems(rubric: Rubric) -> list[str]:
    problems = []
    for criterion in rubric.criteria:
        if sorted(criterion.levels) != ["A", "B", "C", "D"]:
            problems.append(f"{criterion.id} needs words for the levels A, B, C and D")
        total = sum(r.points for r in criterion.requirements)
        if abs(total - criterion.points) > 1e-9:
            problems.append(f"{criterion.id} has {criterion.points:g} points, its requirements {total:g}")
    for requirement in rubric.requirements:
        total = sum(check.points for check in requirement.checks)
        if requirement.checks and abs(total - requirement.points) > 1e-9:
            problems.append(f"{requirement.id} has {requirement.points:g} points, its checks {total:g}")
        advanced = sum(check.points for check in requirement.checks if check.level == "advanced")
        if requirement.checks and abs(advanced - requirement.advanced) > 1e-9:
            problems.append(f"{requirement.id} has {requirement.advanced:g} advanced points, its checks {advanced:g}")
    problems += [
        f"{check.id} has the level {check.level!r}, neither core nor advanced"
        for check in rubric.checks
        if check.level not in ("core", "advanced")
    ]
    parts: tuple[Criterion | Requirement | Check, ...] = (*rubric.criteria, *rubric.requirements, *rubric.checks)
    problems += [f"{part.id} has {part.points:g} points" for part in parts if not 0 <= part.points < math.inf]
    ids = [part.id for part in parts]
    problems += [f"{name} is listed twice" for name in sorted({name for name in ids if ids.count(name) > 1})]
    return problems
