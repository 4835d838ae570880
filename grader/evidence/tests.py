"""Facts about the package's own tests: their results, what they cover, and which mutants they notice."""

from __future__ import annotations

from dataclasses import dataclass, field


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

    `possible` counts every mutant that the operators could make. What tests in `set_aside` noticed does not count,
    because their results did not repeat; tests in `convicted` failed repeatedly on equivalent mutants.
    `quiet_seconds` is the time that the runs would have taken on an otherwise idle machine; the budget limits that.
    """

    seed: int
    possible: int
    mutants: list[Mutant] = field(default_factory=list)
    equivalent_mutants: list[EquivalentMutant] = field(default_factory=list)
    set_aside: list[str] = field(default_factory=list)
    convicted: list[str] = field(default_factory=list)
    wall_seconds: float = 0.0
    quiet_seconds: float = 0.0
    budget_seconds: float = 0.0
    note: str = ""
