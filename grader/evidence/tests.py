"""Facts about the package's own tests: their results, what they cover, and which mutants they notice."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(frozen=True)
class TestModule:
    """One test module of the package, as read (not run) and as run in a process of its own."""

    path: str
    stub: bool
    tests: int
    asserting: int
    subjects: list[str]
    silent: list[str] = field(default_factory=list)
    """The tests that assert nothing."""
    passed: int = 0
    failed: int = 0
    skipped: int = 0
    errors: int = 0
    timed_out: bool = False
    failures: list[str] = field(default_factory=list)
    unsteady: list[str] = field(default_factory=list)
    """The tests that failed, and passed when the module was run again: they count as passed."""
    output_tail: str = ""


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
    doubts: list[str] = field(default_factory=list)
    """What the reports said in runs whose result was known beforehand, and should not have."""


@dataclass(frozen=True)
class Mutant:
    """One fault put into the package's source. `outcome` is "noticed", "unnoticed", "unreached" or "not tried"."""

    path: str
    line: int
    function: str
    operator: str
    words: str
    outcome: str
    by: str = ""
    """The test that noticed it, "" for none."""
    late: bool = False
    """Whether it was noticed because a test came to no end."""
    tried: list[str] = field(default_factory=list)
    """For a fault that no test noticed: the tests that reached it and passed."""


def short_name(test: str) -> str:
    """Return "test_it[a]" for the test "test/test_x.py::TestIt::test_it[a]"."""
    head, bracket, rest = test.partition("[")
    return head.rpartition("::")[2] + bracket + rest


@dataclass(frozen=True)
class EquivalentMutant:
    """One change that keeps the behaviour, and the tests that failed all the same."""

    path: str
    line: int
    words: str
    tests: int
    failed: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class Mutation:
    """Faults put into the package's source, and whether its own tests noticed. `possible` counts all there could be."""

    seed: int
    possible: int
    mutants: list[Mutant] = field(default_factory=list)
    equivalent_mutants: list[EquivalentMutant] = field(default_factory=list)
    set_aside: list[str] = field(default_factory=list)
    """Tests whose results did not repeat; what they noticed does not count."""
    convicted: list[str] = field(default_factory=list)
    """Tests that failed, again and again, on changes that keep the behaviour."""
    wall_seconds: float = 0.0
    quiet_seconds: float = 0.0
    """What the runs would have taken by the clock if nothing else had been going on; the budget is held against it."""
    budget_seconds: float = 0.0
    note: str = ""
