"""Who computes at the same time in one grading."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import ExitStack

import pytest

from grader.host import turns


@pytest.fixture(autouse=True)
def two_cores(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(turns.os, "cpu_count", lambda: 2)


@pytest.fixture
def started() -> Iterator[Started]:
    """Threads that each compute beside others until the test is over."""
    found = Started()
    yield found
    found.over.set()
    for thread in found.threads:
        thread.join(60.0)


class Started:
    def __init__(self) -> None:
        self.over = threading.Event()
        self.threads: list[threading.Thread] = []
        self.running = threading.Semaphore(0)

    def start(self, count: int) -> None:
        new = [threading.Thread(target=self._compute, daemon=True) for _ in range(count)]
        self.threads += new
        for thread in new:
            thread.start()

    def _compute(self) -> None:
        with turns.free_slot():
            self.running.release()
            self.over.wait(60.0)

    def await_running(self, count: int) -> None:
        for _ in range(count):
            assert self.running.acquire(timeout=60.0)

    def runs_another(self) -> bool:
        return self.running.acquire(timeout=0.2)


def test_each_core_has_two_slots(started: Started):
    started.start(5)
    started.await_running(4)
    assert not started.runs_another()


def test_reserved_slots_are_not_free(started: Started):
    with turns.reserve(2):
        started.start(5)
        started.await_running(2)
        assert not started.runs_another()
    started.await_running(2)
    assert not started.runs_another()


def test_a_reservation_never_waits(started: Started):
    started.start(4)
    started.await_running(4)
    with turns.reserve(2), turns.reserve(2):
        pass


def test_one_slot_at_least_is_free(started: Started):
    with ExitStack() as stack:
        for _ in range(4):
            stack.enter_context(turns.reserve(2))
        started.start(2)
        started.await_running(1)
        assert not started.runs_another()


def test_an_error_makes_room(started: Started):
    with pytest.raises(ValueError, match="broken"), turns.reserve(3):
        raise ValueError("broken")
    for _ in range(4):
        with pytest.raises(ValueError, match="broken"), turns.free_slot():
            raise ValueError("broken")
    started.start(4)
    started.await_running(4)
