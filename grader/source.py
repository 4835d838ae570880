"""What a source of evidence is. Each says which requirements it serves; collect.py asks those that are needed."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from enum import Enum
from functools import cached_property
from pathlib import Path
from typing import Any, Protocol

from grader import building
from grader.building import Built
from grader.checks import checks_run
from grader.evidence import Flag
from grader.intake.submission import Submission
from grader.processes.jobs import Job
from grader.settings import Settings

_NO_SOURCE = ("__pycache__", ".git", ".pytest_cache")


class Phase(Enum):
    """When a source collects, and beside what."""

    TEXT = (
        "reads the package and runs nothing of it, so it goes on beside a build; again if that has made code that ran"
    )
    DATA = "reads what was handed in beside the package's code, so it needs no build of it"
    RUN = "needs the build"


@dataclass(frozen=True)
class Subject:
    """What a source collects evidence about, and how.

    `folder` is for what jobs write; `closing` closes what they use when all are done. `built` and `contract` (the
    contract's own interfaces) are there in the phase RUN alone. `left` has by their paths the files that the build has
    made and of which code ran: with these the text is read again.
    """

    submission: Submission
    settings: Settings
    folder: Path
    closing: ExitStack = field(default_factory=ExitStack)
    built: Built | None = None
    contract: Built | None = None
    left: Mapping[str, Path] = field(default_factory=dict)

    @property
    def ros_name(self) -> str:
        """Return the name under which the package was installed, by which `ros2 run` finds it."""
        assert self.built is not None
        return self.built.facts.package

    @cached_property
    def handed_in(self) -> str:
        """Return a hash of everything that was handed in of the package and its interfaces."""
        submission = self.submission
        return building.content_key([path for path in (submission.package, submission.interfaces) if path])

    @cached_property
    def seen_by_nodes(self) -> str:
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
    """What a source has found: fields of Evidence by name, flags, and files of the build's own that ran, by path."""

    facts: Mapping[str, object] = field(default_factory=dict)
    flags: tuple[Flag, ...] = ()
    left: Mapping[str, Path] = field(default_factory=dict)


@dataclass(frozen=True)
class Asked:
    """The jobs of a source, each of which raises GraderError if this host keeps it from being done.

    `collected` returns the evidence that the results of the jobs, by their names, are.
    """

    jobs: Sequence[Job[Any]]
    collected: Callable[[Mapping[str, Any]], Collected]


class Source(Protocol):
    """One source of evidence."""

    name: str
    phase: Phase = Phase.RUN

    def serves(self, settings: Settings) -> frozenset[str]:
        """Return the ids of the requirements that its evidence is for."""
        return served(settings, self.name)

    def ask(self, subject: Subject) -> Asked:
        """Return what is to be done to collect its evidence of the subject. Nothing of it is done yet."""


def served(settings: Settings, what: str) -> frozenset[str]:
    """Return the ids of the requirements with a check whose module names `what` among its NEEDS."""
    return checks_run.served(settings.course, settings.rubric, what)
