"""A module with failures is run again, and a test that passes in one of the two runs has passed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import pytest

from grader import evidence
from grader.student_tests import suite_run, warm_worker

MODULE = evidence.TestModule("test/test_it.py", stub=False, tests=2, asserting=2, subjects=["robot_controller"])


def ran(**outcomes: str) -> warm_worker.Ran:
    tests = tuple(
        warm_worker.Test(f"{MODULE.path}::{name}", outcome, "assert False") for name, outcome in outcomes.items()
    )
    return warm_worker.Ran(
        tests, tuple(test.id for test in tests), broken="", ended=True, status=0, late="", seconds=1.0,
        quiet_seconds=1.0, shared=False, refused=(), output_tail="", reach={},
    )  # fmt: skip


class Bench:
    """Answers each request with the next of the runs it was given."""

    out = Path("out")

    def __init__(self, runs: Sequence[warm_worker.Ran]) -> None:
        self.runs = iter(runs)

    def run(self, _request: warm_worker.Request) -> warm_worker.Ran:
        return next(self.runs)


@pytest.fixture
def own_tests(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    """Return a function from the runs of the module to the module's results; whatever is left of the runs is unused."""
    monkeypatch.setattr(suite_run.canary, "judge_canary", lambda _ran, _bird: "")
    monkeypatch.setattr(suite_run, "_doubts", lambda *_: [])
    monkeypatch.setattr(suite_run, "combine", lambda *_: ([], []))

    def results(*runs: warm_worker.Ran) -> tuple[evidence.TestModule, int]:
        scripted = Bench(runs)

        @contextmanager
        def benches(*_: object, **__: object) -> Iterator[tuple[Bench, Bench]]:
            yield scripted, scripted

        monkeypatch.setattr(suite_run, "benches", benches)
        (module,) = suite_run.run_modules(tmp_path, tmp_path, [MODULE]).tests.modules
        return module, len(list(scripted.runs))

    return results


def test_what_passes_the_second_time_has_passed_and_is_named(own_tests):
    """Two nodes that did not find each other in time cost the reference a hundredth of a point now and then."""
    module, _ = own_tests(ran(test_flickers="failed", test_steady="passed"), ran(test_flickers="passed"))
    assert (module.passed, module.failed) == (2, 0)
    assert module.unsteady == ["test_flickers"]
    assert module.failures == []


def test_what_fails_twice_has_failed(own_tests):
    module, _ = own_tests(ran(test_wrong="failed", test_broken="error"), ran(test_wrong="failed", test_broken="error"))
    assert (module.passed, module.failed, module.errors) == (0, 1, 1)
    assert module.unsteady == []
    assert [failure.partition(":")[0] for failure in module.failures] == ["test_wrong", "test_broken"]


def test_what_passes_is_not_run_again(own_tests):
    module, unused = own_tests(ran(test_steady="passed"), ran(test_steady="failed"))
    assert (module.passed, module.failed) == (1, 0)
    assert unused == 1
