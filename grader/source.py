"""What a source of evidence is. Each says which requirements it serves; collect.py asks those that are needed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from functools import cached_property
from pathlib import Path
from typing import Protocol

from grader import building
from grader.building import Built
from grader.checks import checks_run
from grader.evidence import Flag
from grader.evidence.kept import Kept
from grader.intake.submission import Submission
from grader.settings import Settings

_NO_SOURCE = ("__pycache__", ".git", ".pytest_cache")


class Phase(Enum):
    """When a source collects, and beside what."""

    TEXT = (
        "reads the package and runs nothing of it, so it goes on beside a build; again if that has made code that ran"
    )
    RUN = "needs the build; all sources of this phase collect at the same time, but for those that use others"


@dataclass(frozen=True)
class Subject:
    """What a source collects evidence about, and how. `kept` has what was collected earlier.

    `folder` is an empty folder of the source's own. `built` and `contract` (the contract's own interfaces) are None in
    the phase TEXT, but where code ran that the build has made. `earlier` has what the sources that this one `uses`
    handed over, by their names, and then the trials that code.
    """

    submission: Submission
    settings: Settings
    folder: Path
    kept: Kept = field(default_factory=Kept)
    built: Built | None = None
    contract: Built | None = None
    earlier: Mapping[str, object] = field(default_factory=dict)

    @property
    def ros_name(self) -> str:
        """Return the name under which the package was installed, by which `ros2 run` finds it."""
        assert self.built is not None
        return self.built.facts.package

    @cached_property
    def text(self) -> str:
        """Return a hash of everything that was handed in of the package and its interfaces."""
        submission = self.submission
        return building.content_key([path for path in (submission.package, submission.interfaces) if path])

    @cached_property
    def program(self) -> str:
        """Return a hash of all that nodes can see: what is installed, and the package without its tests."""
        assert self.contract is not None
        trees = (building.checksum(self.install), building.checksum(self.contract.install), self.ros_name)
        return building.content_key([self.submission.package], *trees, leaving_out=("test", "tests", *_NO_SOURCE))

    @property
    def install(self) -> Path:
        """Return the package's install tree."""
        assert self.built is not None
        return self.built.install


@dataclass(frozen=True)
class Collected:
    """What a source has found: fields of Evidence by name, flags, and what it hands over to sources that use it.

    `kept` says of what was collected earlier when that was.
    """

    facts: Mapping[str, object] = field(default_factory=dict)
    flags: tuple[Flag, ...] = ()
    handover: object = None
    kept: Mapping[str, str] = field(default_factory=dict)


class Source(Protocol):
    """One source of evidence."""

    name: str
    phase: Phase = Phase.RUN
    uses: frozenset[str] = frozenset()
    """The names of sources that must have collected before it begins. They use none themselves."""

    def serves(self, settings: Settings) -> frozenset[str]:
        """Return the ids of the requirements that its evidence is for."""
        return served(settings, self.name)

    def collect(self, subject: Subject) -> Collected:
        """Return what there is to see of the subject.

        Raises:
            GraderError: this host keeps it from being seen.
        """


def served(settings: Settings, what: str) -> frozenset[str]:
    """Return the ids of the requirements with a check whose module names `what` among its NEEDS."""
    return checks_run.served(settings.course, settings.rubric, what)
