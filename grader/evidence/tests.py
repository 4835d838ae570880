"""Facts about the package's own tests: their results, what they cover, and which mutants they notice."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(frozen=True)
class TestModule:
    """One test module of the package: facts from reading it, and results from running it in a process of its own.

    `subjects` are the nodes whose code its tests run, and assert something about; `silent` are the tests that assert
    nothing, or cannot fail. `reaches` says whether its tests run any code of the package, beyond importing it.
    `unsteady` tests passed in one of two runs and failed in the other; they count neither way.
    """

    path: str
    stub: bool
    tests: int
    asserting: int
    subjects: list[str]
    silent: list[str] = field(default_factory=list)
    passed: int = 0
    failed: int = 0
    skipped: int = 0
    errors: int = 0
    timed_out: bool = False
    failures: list[str] = field(default_factory=list)
    unsteady: list[str] = field(default_factory=list)
    output_tail: str = ""
    reaches: bool = True


@dataclass(frozen=True)
class FileCoverage:
    """Lines and branches of one source file that the package's own tests reached.

    The `padding` is left out of both: lines that tests reach and no node can come to.
    """

    path: str
    lines: int
    lines_hit: int
    branches: int
    branches_hit: int
    missing: list[int] = field(default_factory=list)
    padding: int = 0


@dataclass(frozen=True)
class StudentTests:
    """The package's own tests: the modules, and what they cover of the package.

    `doubts` say where the tests' reports were wrong in runs whose result was known beforehand. `of_contract` says
    whether the package has a module of the contract, `nodes` are the paths of the modules that make the nodes.
    """

    modules: list[TestModule] = field(default_factory=list)
    coverage: list[FileCoverage] = field(default_factory=list)
    note: str = ""
    doubts: list[str] = field(default_factory=list)
    of_contract: bool = True
    nodes: list[str] = field(default_factory=list)


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
