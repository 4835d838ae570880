"""Each module is run twice, and a test that passes in one run only counts neither as passed nor as failed."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import pytest
from helpers.course import COURSE

from grader import evidence
from grader.student_tests import suite_run
from grader.student_tests.warm_worker import ModuleRequest, WorkerPool
from grader.student_tests.worker_report import ModuleRun, TestResult

MODULE = evidence.TestModule("test/test_it.py", stub=False, tests=2, asserting=2, subjects=["robot_controller"])


def ran(**outcomes: str) -> ModuleRun:
    tests = tuple(TestResult(f"{MODULE.path}::{name}", outcome, "assert False") for name, outcome in outcomes.items())
    return ModuleRun(
        tests, tuple(test.id for test in tests), collection_error="", finished=True, status=0, timed_out="",
        running="", seconds=1.0, quiet_seconds=1.0, shares_fixtures=False, refused_hooks=(), output_tail="", reach={},
    )  # fmt: skip


class ScriptedWorker:
    """Answers each request with the next of the given runs."""

    alive, out = True, Path("worker/out")

    def __init__(self, runs: Sequence[ModuleRun]) -> None:
        self.runs = iter(runs)

    def run(self, _request: ModuleRequest) -> ModuleRun:
        return next(self.runs)


def team_of(worker: ScriptedWorker) -> Callable[..., contextlib.AbstractContextManager[WorkerPool]]:
    @contextlib.contextmanager
    def start(_package: Path, _install: Path, size: int, **_: object) -> Iterator[WorkerPool]:
        yield WorkerPool(lambda _number, _domain: worker, size)  # type: ignore[arg-type,return-value]

    return start


@pytest.fixture
def own_tests(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    """Return a function from scripted runs to the module's results and the number of runs left over."""
    monkeypatch.setattr(suite_run.canary, "judge_canary", lambda _ran, _canary: "")
    monkeypatch.setattr(suite_run.report_checks, "sabotage", lambda *_: [])
    monkeypatch.setattr(suite_run.report_checks, "probe", lambda *_: ({}, set()))
    monkeypatch.setattr(suite_run, "combine", lambda *_: ([], []))

    def results(*runs: ModuleRun) -> tuple[evidence.TestModule, int]:
        worker = ScriptedWorker(runs)
        monkeypatch.setattr(suite_run, "start_workers", team_of(worker))
        (module,) = suite_run.run_suite(tmp_path, tmp_path, [MODULE], COURSE).tests.modules
        return module, len(list(worker.runs))

    return results


@pytest.mark.parametrize("first", ["failed", "passed"])
def test_a_test_that_passes_only_once_counts_neither_way_and_is_named(own_tests, first: str):
    """One that failed first counted as passed, one that passed first was not run again.

    Two nodes that do not discover each other in time are not the author's mistake: such a test costs nothing.
    """
    second = {"failed": "passed", "passed": "failed"}[first]
    module, _ = own_tests(
        ran(test_flickers=first, test_steady="passed"), ran(test_flickers=second, test_steady="passed")
    )
    assert (module.passed, module.failed) == (1, 0)
    assert module.unsteady == ["test_flickers"]
    assert module.failures == []


def test_a_test_that_fails_twice_has_failed(own_tests):
    module, _ = own_tests(ran(test_wrong="failed", test_broken="error"), ran(test_wrong="failed", test_broken="error"))
    assert (module.passed, module.failed, module.errors) == (0, 1, 1)
    assert module.unsteady == []
    assert [failure.partition(":")[0] for failure in module.failures] == ["test_wrong", "test_broken"]


def test_a_module_that_hangs_is_not_run_again(own_tests):
    _, unused = own_tests(replace(ran(test_it="failed"), timed_out="test_it"), ran(test_it="passed"))
    assert unused == 1


def test_the_longest_module_begins_first_and_the_results_keep_their_order(
    monkeypatch: pytest.MonkeyPatch, own_tests, tmp_path: Path
):
    modules = [
        replace(MODULE, path=f"test/test_{name}.py", tests=tests) for name, tests in (("a", 1), ("b", 3), ("c", 2))
    ]
    begun: list[str] = []

    class Recording(ScriptedWorker):
        def run(self, request: ModuleRequest) -> ModuleRun:
            begun.append(request.module)
            return ran(test_it="passed")

    monkeypatch.setattr(suite_run, "WORKERS", 1)
    monkeypatch.setattr(suite_run, "start_workers", team_of(Recording([])))
    found = suite_run.run_suite(tmp_path, tmp_path, modules, COURSE)
    assert list(dict.fromkeys(begun)) == ["test/test_b.py", "test/test_c.py", "test/test_a.py"]
    assert [module.path for module in found.tests.modules] == [module.path for module in modules]
    assert [reach.module for reach in found.reach] == [module.path for module in modules]
