"""All evidence of one grading, and its facts about intake, build, the package's own tests and its mutants; flags."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from grader.evidence.quality import Quality
from grader.evidence.trial import Trial


@dataclass(frozen=True)
class TestModule:
    """One test module of the package: facts from reading it, and results from running it in a process of its own.

    `silent` are the tests that assert nothing, by their text. `unsteady` tests passed in one of two runs and failed in
    the other; they count neither way.

    `reached` are the files of the package of which the tests ran a function. A third run, the probe, is on the package
    with functions that only raise. `tested` are the files of which a test ran a function that asserts something,
    passed before, and failed in the probe. `idle` are the tests that ran functions of the package and passed in the
    probe all the same. `starts` are the nodes whose programs were started, if a test failed in the probe.
    """

    path: str
    stub: bool
    tests: int
    asserting: int
    silent: list[str] = field(default_factory=list)
    passed: int = 0
    failed: int = 0
    skipped: int = 0
    errors: int = 0
    timed_out: bool = False
    failures: list[str] = field(default_factory=list)
    unsteady: list[str] = field(default_factory=list)
    output_tail: str = ""
    reached: list[str] = field(default_factory=list)
    tested: list[str] = field(default_factory=list)
    idle: list[str] = field(default_factory=list)
    starts: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class FileCoverage:
    """Lines and branches of one source file that the package's own tests reached."""

    path: str
    lines: int
    lines_hit: int
    branches: int
    branches_hit: int
    missing: list[int] = field(default_factory=list)


@dataclass(frozen=True)
class StudentTests:
    """The package's own tests: the modules, and what they cover of the package."""

    modules: list[TestModule] = field(default_factory=list)
    coverage: list[FileCoverage] = field(default_factory=list)
    note: str = ""


@dataclass(frozen=True)
class Mutant:
    """One change of the package's source, and whether a test noticed.

    `outcome` is "noticed", "unnoticed", "unreached" or "not tried". `by` is the test that noticed, `late` says that it
    did so by running out of time. For an unnoticed mutant, `tried` are the tests that reached it and passed.
    """

    path: str
    line: int
    function: str
    operator: str
    words: str
    outcome: str
    by: str = ""
    late: bool = False
    tried: list[str] = field(default_factory=list)


def short_name(test: str) -> str:
    """Return "test_it[a]" for the test "test/test_x.py::TestIt::test_it[a]"."""
    head, bracket, rest = test.partition("[")
    return head.rpartition("::")[2] + bracket + rest


@dataclass(frozen=True)
class EquivalentMutant:
    """One change that keeps the behaviour, and the tests that failed nevertheless."""

    path: str
    line: int
    words: str
    tests: int
    failed: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class Mutation:
    """Mutants of the package, and which of its own tests noticed each.

    What tests in `set_aside` noticed does not count, because their results did not repeat; tests in `convicted` failed
    repeatedly on equivalent mutants. `quiet_seconds` is the time that the runs would have taken on an otherwise idle
    machine; the budget limits that.
    """

    seed: int
    mutants: list[Mutant] = field(default_factory=list)
    equivalent_mutants: list[EquivalentMutant] = field(default_factory=list)
    set_aside: list[str] = field(default_factory=list)
    convicted: list[str] = field(default_factory=list)
    wall_seconds: float = 0.0
    quiet_seconds: float = 0.0
    note: str = ""


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
    cached: bool = False
    wall_seconds: float = 0.0
    exit_code: int | None = None
    timed_out: bool = False
    log_tail: str = ""
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


@dataclass(frozen=True)
class FunctionAnswer:
    """What one of the package's functions returned: a number or a quaternion [x, y, z, w]; empty with a `problem`."""

    function: str
    arguments: list[Any]
    answer: list[float] = field(default_factory=list)
    problem: str = ""


@dataclass(frozen=True)
class BrokenPromise:
    """A promise that was broken: its name and sentence, what was seen, and the case as the text of a file."""

    name: str
    sentence: str
    seen: str
    case: str


@dataclass(frozen=True)
class Hunt:
    """How many made-up cases were tried, and the promise that was broken in the last of them, if one was.

    `unsteady` is how many failed once and not again, which counts for nothing. `trial` is the name of the trial that
    shows the broken promise or, where none is broken, of one that says why not all cases could be judged.
    """

    cases: int
    unsteady: int = 0
    broken: BrokenPromise | None = None
    trial: str = ""


@dataclass(frozen=True)
class LeagueCase:
    """A file that was handed in for the league, by its path in the package.

    `problem` is why it cannot be read or run, `unfair` which promise a right package broke in it, and how; both may be
    "". `caught` are the names of the broken packages that broke one.
    """

    path: str
    problem: str = ""
    unfair: str = ""
    caught: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class League:
    """What was handed in for the league, and how many broken packages there are to catch."""

    cases: list[LeagueCase]
    pool: int


@dataclass(frozen=True)
class Evidence:
    """Everything that one grading recorded.

    `hunts` are by the requirement that was hunted for.
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
    league: League | None = None
    origin: dict[str, str] = field(default_factory=dict)
    kept: dict[str, str] = field(default_factory=dict)
    hunts: dict[str, Hunt] = field(default_factory=dict)
