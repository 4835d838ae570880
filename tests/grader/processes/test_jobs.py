"""A list of jobs: what is done, in which order, at the same time as what, and what is taken from an earlier run."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from grader.processes import jobs
from grader.processes.jobs import Job, Turn, Where, run
from grader.processes.kept import Kept


class Work:
    """Makes jobs that note when they were done."""

    def __init__(self) -> None:
        self.done: list[str] = []

    def job(self, name: str, work: Callable[..., Any] = lambda *_: "made", **how: Any) -> Job[Any]:
        def note(*given: Any) -> Any:
            result = work(*given)
            self.done.append(name)
            return result

        return Job(name, Where.HOST, str, note, **how)


@pytest.fixture
def work() -> Work:
    return Work()


@pytest.fixture
def kept(tmp_path: Path) -> Kept:
    return Kept(tmp_path / "kept", ("kit",))


def test_a_job_gets_the_result_of_the_one_before_it_and_says_that_it_begins(work: Work):
    said: list[str] = []
    listed = [
        work.job("a", lambda: "A", says="now a"),
        work.job("b", lambda given: f"{given}B", after="a", says="now b"),
    ]
    assert run(listed, progress=said.append).results == {"a": "A", "b": "AB"}
    assert said == ["now a", "now b"]


@pytest.mark.parametrize("turn", Turn)
def test_a_job_waits_only_for_the_one_that_it_comes_after(work: Work, turn: Turn):
    """Mutants are tried while trials go on."""
    tried = threading.Event()
    trial = work.job("trial", lambda: tried.wait(60.0) and "", turn=turn)
    chain = [
        work.job("tests"),
        work.job("mutants", lambda _: tried.set(), after="tests"),
    ]
    run([trial, *chain])
    assert work.done[0] == "tests"
    assert tried.is_set()


def test_no_more_trials_run_at_once_than_there_are_cores(work: Work, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(jobs, "_TRIALS_AT_ONCE", 2)
    both, two = threading.Barrier(2), threading.Semaphore(2)

    def trial() -> str:
        assert two.acquire(blocking=False)
        both.wait(60.0)
        two.release()
        return ""

    run([work.job(str(number), trial, turn=Turn.CORE) for number in range(6)])
    assert len(work.done) == 6


def test_what_is_kept_is_not_done_again_and_when_it_was_is_said(work: Work, kept: Kept):
    listed = [work.job("a"), work.job("b", after="a", decided_by=("b", "1"))]
    first, second = run(listed, kept), run(listed, kept)
    assert work.done == ["a", "b"]
    assert first.results == second.results
    assert (list(first.kept), list(second.kept)) == ([], ["a", "b"])


@pytest.mark.parametrize("other", [{"name": "other"}, {"decided_by": ("text 2",)}])
def test_what_something_else_decides_is_done(work: Work, kept: Kept, other: dict[str, Any]):
    job = work.job("a", decided_by=("text 1",))
    run([job], kept)
    assert run([replace(job, **other)], kept).kept == {}
    assert len(work.done) == 2


def test_what_may_end_in_another_way_is_done_again_and_all_that_comes_after_it(work: Work, kept: Kept):
    listed = [work.job("a", lasting=lambda _result: False), work.job("b", after="a"), work.job("c")]
    run(listed, kept)
    assert list(run(listed, kept).kept) == ["c"]
    assert sorted(work.done) == ["a", "a", "b", "b", "c"]


@pytest.mark.parametrize("turn", Turn)
def test_an_error_is_raised_and_what_comes_after_its_job_is_not_done(work: Work, turn: Turn):
    def fail() -> str:
        raise OSError("disk full")

    with pytest.raises(OSError, match="disk full"):
        run([work.job("a", fail, turn=turn), work.job("b", after="a")])
    assert work.done == []
