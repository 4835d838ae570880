"""How to grade: rubric, seed, limits, and which requirements."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields
from enum import StrEnum
from pathlib import Path
from typing import Any

from grader.course import Course, kits_own, named
from grader.scoring import rubric as rubrics
from grader.scoring.rubric import Requirement, Rubric

MODULE_TIMEOUT_S = 90.0
# Fifty mutants take the course's tests 9 s, and 70 s if no assert of theirs can fail: then each mutant takes them all.
# With 60 s such a package was tried on 30 or 40 of 50, as the machine was busy or not, and its points differed by it.
MUTATION_BUDGET_S = 180.0


class Reuse(StrEnum):
    """What a grading does with the evidence of earlier ones of the same content, kit, machine and seed."""

    NONE = "neither takes nor keeps any"
    KEPT = "takes what is kept, and keeps the rest"
    ANEW = "collects all of it anew, and keeps that"

    @classmethod
    def unless(cls, fresh: bool) -> Reuse:
        """Return KEPT, or ANEW if all is to be `fresh`."""
        return cls.ANEW if fresh else cls.KEPT


@dataclass(frozen=True)
class Settings:
    """How to grade. Times are wall seconds; `seed` decides the trials' speeds, places and noise.

    Attributes:
        cache: the folder for builds.
        course: the assignment that is graded, by default the kit's own.
        build_seconds: the limit for `colcon build`.
        mutation_budget_s: the time to spend on mutants, as wall time of a quiet machine.
        requirements: judge only these; by default all that have checks.
        package_path: the package to grade, by its place in the submission; by default the grader chooses.
        best_effort: whether the simulated sensors publish best effort, as many drivers do. In a grading they are
            reliable, so that a reliable subscription costs I4 alone; in the course they are as on a robot.
        reuse: whether evidence is kept for the next grading, and taken where all that decides it is the same.
        progress: called with a few words whenever something new begins.
    """

    rubric: Rubric
    cache: Path
    course: Course = field(default_factory=kits_own)
    seed: int = 0
    build_seconds: float = 300.0
    mutation_budget_s: float = MUTATION_BUDGET_S
    requirements: tuple[str, ...] = ()
    package_path: str = ""
    best_effort: bool = False
    reuse: Reuse = Reuse.NONE
    progress: Callable[[str], None] = lambda _what: None

    def plain(self) -> dict[str, Any]:
        """Return as JSON can hold it all but the rubric and the progress; of the course, its folder."""
        objects = ("rubric", "progress")
        values = {f.name: getattr(self, f.name) for f in fields(self) if f.name not in objects}
        return values | {"cache": str(self.cache), "course": str(self.course.folder)}

    @classmethod
    def of_plain(cls, plain: Mapping[str, Any], progress: Callable[[str], None]) -> Settings:
        """Return the settings of which `plain` has returned this, with the course's own rubric."""
        course = named(plain["course"])
        fields_ = {"course": course, "cache": Path(plain["cache"]), "requirements": tuple(plain["requirements"])}
        fields_["reuse"] = Reuse(plain["reuse"])
        return cls(rubric=rubrics.load(course.rubric), progress=progress, **{**plain, **fields_})

    @property
    def wanted(self) -> list[Requirement]:
        """Return the requirements to judge, in the rubric's order."""
        return [r for r in self.rubric.requirements if not self.requirements or r.id in self.requirements]

    @property
    def checked(self) -> frozenset[str]:
        """Return the ids of the requirements to judge that have checks, and so need evidence."""
        return frozenset(requirement.id for requirement in self.wanted if requirement.checks)
