"""Turn the runs of a test module into facts: its results, what its tests reach, and flags."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence, Set
from dataclasses import dataclass, field, replace
from functools import cached_property
from types import MappingProxyType

from grader.evidence import Flag, TestModule, short_name
from grader.student_tests.worker_report import ModuleRun, TestResult, started_nodes

_FLAGGED_LINES = 30  # a test of an error or two that cannot fail runs fewer


@dataclass(frozen=True)
class ModuleReach:
    """What one module's tests reach: the seconds of each test that passed, and the tests that reached each line.

    The test "" stands for importing, and for fixtures that several tests share. Where there are such fixtures the
    tests depend on each other (`interdependent`), and only a run of all of them is meaningful.
    """

    module: str
    seconds: Mapping[str, float]
    lines: Mapping[str, Mapping[int, frozenset[str]]]
    interdependent: bool = False


@dataclass(frozen=True)
class ModuleRuns:
    """The one or two runs of a test module, and the one on functions that only raise, if a test has passed before.

    `functions` are the lines inside the functions of each of the package's files.
    """

    module: TestModule
    runs: Sequence[ModuleRun]
    probe: ModuleRun | None = None
    functions: Mapping[str, frozenset[int]] = field(default_factory=dict)

    @cached_property
    def unsteady(self) -> set[str]:
        """Return the tests that passed in one of two runs of the same code, and failed in the other."""
        passed = [{test.id for test in run.tests if test.outcome == "passed"} for run in self.runs]
        failed = [{*(test.id for test in failures(run)), run.timed_out} for run in self.runs]
        return {name for both in zip(passed, reversed(failed), strict=True) for name in both[0] & both[1]}

    @property
    def passed_first(self) -> list[TestResult]:
        """Return the tests that passed in the first run, in which the lines are measured."""
        return [test for test in self.runs[0].tests if test.outcome == "passed" and not test.xfail]

    @property
    def passed(self) -> list[TestResult]:
        """Return the tests that passed and are steady."""
        return [test for test in self.passed_first if test.id not in self.unsteady]

    @cached_property
    def called(self) -> dict[str, set[str]]:
        """The files of which each test has called a function, "" for what tests share. Importing is not a call."""
        found: dict[str, set[str]] = {}
        for ran in self.runs:
            for path, lines in ran.reach.items():
                for line in lines.keys() & self.functions.get(path, frozenset()):
                    for test in lines[line] - ({""} if line in ran.imported.get(path, ()) else set()):
                        found.setdefault(test, set()).add(path)
        return found

    @property
    def noticing(self) -> set[str]:
        """Return the tests that passed before and failed in the probe."""
        if self.probe is None:
            return set()
        names = {test.id for test in self.passed}
        if self.probe.collection_error:
            return names
        return names & {self.probe.culprit, *(test.id for test in failures(self.probe))}

    @property
    def idle(self) -> set[str]:
        """Return the tests that called functions of the package and passed in the probe all the same."""
        if self.probe is None:
            return set()
        again = {test.id for test in self.probe.tests if test.outcome == "passed"}
        return {test.id for test in self.passed_first if test.id in again and test.id in self.called}

    def reach(self) -> ModuleReach:
        """Return what the steady tests reach."""
        ran = self.runs[0]
        # No test took longer than all of them together, whatever the report says: time limits are derived from these.
        seconds = {test.id: min(test.seconds, ran.seconds) for test in self.passed}
        return ModuleReach(self.module.path, seconds, ran.reach, ran.shares_fixtures)

    def results(self, nodes: Collection[str], places: Mapping[str, str] = MappingProxyType({})) -> TestModule:
        """Return the module with what its runs reported; `places` are files that the build installs from elsewhere.

        A test that was started or collected and has no result is an error. One that passed in one run and failed in the
        other has neither passed nor failed.
        """
        ran, loose = self.runs[0], self.unsteady
        counts = Counter(test.outcome for test in ran.tests if test.id not in loose)
        messages = [f"{_short(test.id)}: {' '.join(test.message.split())[:200]}" for test in failures(ran, loose)]
        missing, reasons = _missing(self.module, ran)
        asserting = {name for name in self.noticing if _function(name) not in self.module.silent}
        idle = {_function(name) for name in self.idle} - {_function(name) for name in self.noticing}
        started = {node for run in self.runs for line in run.started for node in started_nodes(line, nodes)}
        return replace(
            self.module, passed=counts["passed"], failed=counts["failed"], errors=counts["error"] + missing,
            skipped=counts["skipped"], timed_out=bool(ran.timed_out), failures=[*messages, *reasons][:20],
            unsteady=sorted(map(_short, loose))[:20], output_tail=ran.output_tail,
            reached=self._files(self.called, places), idle=sorted(idle)[:50],
            tested=self._files({"", *asserting} if asserting else (), places),
            starts=sorted(started) if asserting else [],
        )  # fmt: skip

    def _files(self, tests: Iterable[str], places: Mapping[str, str]) -> list[str]:
        files = set[str]().union(*(self.called.get(test, ()) for test in tests))
        return sorted(places.get(path, path) for path in files)


def failures(ran: ModuleRun, but: Set[str] = frozenset()) -> list[TestResult]:
    """Return the tests that failed or ended in an error, without some."""
    return [test for test in ran.tests if test.outcome in ("failed", "error") and test.id not in but]


def _missing(module: TestModule, ran: ModuleRun) -> tuple[int, list[str]]:
    """Return how many tests have no result and count as errors, and why."""
    missing = max(0, (len(ran.collected) or module.tests) - len(ran.tests))
    if ran.timed_out:
        # Only the test that ran out of time is to blame; those after it had no chance to run.
        reported = any(test.id == ran.timed_out for test in ran.tests)
        return (0, []) if reported else (1, [f"{_short(ran.timed_out)}: ran out of time"])
    if ran.collection_error:
        return max(1, missing), [f"{module.path} could not be read by pytest: {ran.collection_error}"]
    if not ran.finished:
        words = f"{module.path}: the process ended with status {ran.status} before pytest had finished"
        return max(1, missing), [words]
    return 0, []


def flags(measured: Sequence[ModuleRuns]) -> list[Flag]:
    """Return a flag for many lines that only tests which cannot fail have run."""
    idle = set[str]().union(*(each.idle for each in measured))
    lines = _only_of(idle, measured) if idle else 0
    if lines < _FLAGGED_LINES:
        return []
    names = ", ".join(short_name(name) for name in sorted(idle)[:3])
    words = f"{lines} lines were run by tests only that pass although all that they call raises: {names}"
    return [Flag("test reports", words, where=min(idle).partition("::")[0], concerns=["student tests"])]


def _only_of(tests: Set[str], measured: Sequence[ModuleRuns]) -> int:
    """Return how many lines inside functions these tests have run and no others."""
    by_line: dict[tuple[str, int], set[str]] = {}
    for each in measured:
        for path, lines in each.runs[0].reach.items():
            for line in lines.keys() & each.functions.get(path, frozenset()):
                by_line.setdefault((path, line), set()).update(lines[line])
    return sum(bool(names) and names <= tests for names in by_line.values())


def _function(test: str) -> str:
    return _short(test).partition("[")[0]


def _short(test: str) -> str:
    return test.rpartition("::")[2][:100]
