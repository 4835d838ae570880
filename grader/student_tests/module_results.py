"""Turn the runs of a test module into facts: its results, what its tests reach, and flags."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence, Set
from dataclasses import dataclass, replace

from grader.evidence import Flag, TestModule
from grader.quality.reachability import Reachability
from grader.student_tests.worker_report import ModuleRun, TestResult, started_nodes


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
    source_readers: frozenset[str] = frozenset()
    """Tests that read the package's source: what they notice says nothing about what the package does."""


def module_reach(module: TestModule, ran: ModuleRun, again: ModuleRun | None = None) -> ModuleReach:
    """Return what the steady tests of a module reach."""
    loose = unsteady(ran, again)
    passed = [test for test in ran.tests if test.outcome == "passed" and not test.xfail and test.id not in loose]
    # No test took longer than all of them together, whatever the report says: time limits are derived from these.
    seconds = {test.id: min(test.seconds, ran.seconds) for test in passed}
    return ModuleReach(module.path, seconds, ran.reach, ran.shares_fixtures, ran.source_readers)


def failures(ran: ModuleRun, but: Set[str] = frozenset()) -> list[TestResult]:
    """Return the tests that failed or ended in an error, without some."""
    return [test for test in ran.tests if test.outcome in ("failed", "error") and test.id not in but]


def unsteady(ran: ModuleRun, again: ModuleRun | None) -> set[str]:
    """Return the tests that passed in one of two runs of the same code, and failed in the other."""
    runs = [ran, again] if again is not None else []
    passed = [{test.id for test in run.tests if test.outcome == "passed"} for run in runs]
    failed = [{*(test.id for test in failures(run)), run.timed_out} for run in runs]
    return {name for both in zip(passed, reversed(failed), strict=True) for name in both[0] & both[1]}


def with_results(module: TestModule, code: Reachability, runs: Sequence[ModuleRun], idle: bool = False) -> TestModule:
    """Return the module with what its one or two runs reported, and which of the package's nodes its tests reach.

    A test that was started or collected and has no result is an error. One that passed in one run and failed in the
    other has neither passed nor failed. A node counts as tested by tests that assert something and are steady; where
    all tests are `idle`, none asserts anything: they passed although the functions that they call raised.
    """
    ran, again = runs[0], runs[1] if len(runs) > 1 else None
    loose = unsteady(ran, again)
    counts = Counter(test.outcome for test in ran.tests if test.id not in loose)
    messages = [f"{_short(test.id)}: {' '.join(test.message.split())[:200]}" for test in failures(ran, loose)]
    missing, reasons = _missing(module, ran)
    silent = {test.id for test in ran.tests if idle or _short(test.id).partition("[")[0] in module.silent}
    started = {node for run in runs for line in run.started for node in started_nodes(line, code.homes)}
    called = _called(code, runs, but=frozenset())
    tested = _called(code, runs, but=silent | loose) if {test.id for test in ran.tests} - silent - loose else set()
    if idle:
        names = list(dict.fromkeys(_short(name).partition("[")[0] for name in sorted(silent)))
        module = replace(module, asserting=0, silent=names[:50])
    return replace(
        module, passed=counts["passed"], failed=counts["failed"], errors=counts["error"] + missing,
        skipped=counts["skipped"], timed_out=bool(ran.timed_out), failures=[*messages, *reasons][:20],
        unsteady=sorted(map(_short, loose))[:20], output_tail=ran.output_tail,
        subjects=[node for node, homes in code.homes.items() if homes & tested or node in started],
        reaches=bool(called or started),
    )  # fmt: skip


def _called(code: Reachability, runs: Iterable[ModuleRun], but: Set[str]) -> set[str]:
    """Return the modules of which others than the tests `but` have called a function: importing does not test."""
    return {
        path
        for ran in runs
        for path, lines in ran.reach.items()
        for line in lines.keys() & code.bodies.get(path, frozenset())
        if lines[line] - but - ({""} if line in ran.imported.get(path, ()) else set())
    }


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


def flags(doubts: Sequence[str], runs: Mapping[str, ModuleRun], code: Reachability) -> list[Flag]:
    """Return the flags for reports in doubt, hooks that were not called, and tests that read the package's source."""
    found = [Flag("test reports", problem, where=problem.partition(":")[0]) for problem in doubts]
    for hook, where in sorted({hook for ran in runs.values() for hook in ran.refused_hooks}):
        words = f"{where} has the hook {hook}, which can rewrite results; the grader's pytest does not call it"
        found.append(Flag("pytest hook", words, where=where))
    return found + [flag for path, ran in runs.items() for flag in _source_readers(path, ran, code)]


def _source_readers(path: str, ran: ModuleRun, code: Reachability) -> list[Flag]:
    """Return a flag if tests of a module both call the package and read its source; a linter only reads it."""
    users = {
        name
        for inside, lines in ran.reach.items()
        for line in lines.keys() & code.bodies.get(inside, frozenset())
        for name in lines[line]
    }
    both = sorted(test.id for test in ran.tests if test.id in users & ran.source_readers)
    if not both:
        return []
    names = ", ".join(_short(name) for name in both[:5])
    return [Flag("source read", f"{names} read the package's source as text; mutants they notice do not count", path)]


def _short(test: str) -> str:
    return test.rpartition("::")[2][:100]
