"""All evidence of one grading, and the facts that every grading has: intake, build, flags."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from grader.evidence.quality import Quality
from grader.evidence.tests import Mutation, StudentTests
from grader.evidence.trial import Trial


@dataclass(frozen=True)
class Flag:
    """Something an instructor should look at, such as an attempt at tampering or a grading without a sandbox.

    `where` is the file and `trial` the trial in which it was seen, or several with commas; either may be "". `concerns`
    names what may not mean what it says, as the NEEDS of checks have it ("what ran", "student tests", "mutation",
    "readme"): the requirements of these checks are the ones concerned.
    """

    kind: str
    what: str
    where: str = ""
    trial: str = ""
    concerns: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class Intake:
    """The submission as it was taken in. Paths are relative to the unpacked submission.

    `others` are packages in it that were not graded, `chosen_because` says why this one was.
    """

    name: str
    sha256: str
    package: str
    package_path: str
    files: list[str] = field(default_factory=list)
    others: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    interfaces_package: str = ""
    chosen_because: str = ""


@dataclass(frozen=True)
class Build:
    """How `colcon build` went, and what it installed.

    `type_hashes` maps "srv/SetSpeed" to its RIHS01 hash, `interface_texts` to its definition; the `contract_` ones are
    those of the contract's own interfaces. `stopped` is the sandbox's limit that the build exceeded: "memory",
    "processes", "disk" or "". `flags` are about what it installed.

    `package` is the name under which the package was installed; `types_package` is the package that has the interfaces.
    `executables` are the programs where `ros2 run` looks, `misplaced` the nodes that are elsewhere, with their folders.
    """

    ok: bool
    cached: bool
    wall_seconds: float
    exit_code: int | None
    timed_out: bool
    log_tail: str
    executables: list[str] = field(default_factory=list)
    shared_files: list[str] = field(default_factory=list)
    type_hashes: dict[str, str] = field(default_factory=dict)
    interface_texts: dict[str, str] = field(default_factory=dict)
    contract_hashes: dict[str, str] = field(default_factory=dict)
    contract_texts: dict[str, str] = field(default_factory=dict)
    stopped: str = ""
    flags: list[Flag] = field(default_factory=list)
    package: str = ""
    types_package: str = ""
    misplaced: dict[str, str] = field(default_factory=dict)

    @classmethod
    def not_tried(cls, package: str) -> Build:
        """Return the facts of a package that was not built because no wanted requirement needs it."""
        return cls(
            ok=False, cached=False, wall_seconds=0.0, exit_code=None, timed_out=False, log_tail="",
            package=package, types_package=package,
        )  # fmt: skip


@dataclass(frozen=True)
class FunctionAnswer:
    """What one of the package's functions returned: a number or a quaternion [x, y, z, w]; empty with a `problem`."""

    function: str
    arguments: list[Any]
    answer: list[float] = field(default_factory=list)
    problem: str = ""


@dataclass(frozen=True)
class Evidence:
    """Everything that one grading recorded.

    `kept` says of what was collected in an earlier grading of the same content when that was, local time.
    `origin` says by name how to get the same again: seed, versions, hashes of the kit and of the submission.
    """

    intake: Intake
    build: Build
    tests: StudentTests | None = None
    trials: dict[str, Trial] = field(default_factory=dict)
    flags: list[Flag] = field(default_factory=list)
    functions: list[FunctionAnswer] = field(default_factory=list)
    quality: Quality | None = None
    mutation: Mutation | None = None
    origin: dict[str, str] = field(default_factory=dict)
    kept: dict[str, str] = field(default_factory=dict)
