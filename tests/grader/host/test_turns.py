"""Who computes at the same time in one grading."""

from __future__ import annotations

import threading
from collections.abc import Callable
from contextlib import ExitStack, suppress

import pytest

from grader.host import turns


class WouldWaitError(Exception):
    """No slot is free."""


@pytest.fixture
def free_slots(monkeypatch: pytest.MonkeyPatch) -> Callable[[], int]:
    """Return what counts, on two cores, the slots that can be had without waiting."""
    monkeypatch.setattr(turns.os, "cpu_count", lambda: 2)

    def wait_for(condition: Callable[[], bool]) -> None:
        if not condition():
            raise WouldWaitError

    def count() -> int:
        found = 0
        with ExitStack() as stack, suppress(WouldWaitError), monkeypatch.context() as patched:
            patched.setattr(turns._changed, "wait_for", wait_for)
            while True:
                stack.enter_context(turns.free_slot())
                found += 1
        return found

    return count


def test_reserved_slots_are_not_free_but_one_always_is(free_slots: Callable[[], int]):
    counts = [free_slots()]
    with ExitStack() as stack:
        for _ in range(4):
            stack.enter_context(turns.reserve(1))  # which never waits
            counts.append(free_slots())
    assert [*counts, free_slots()] == [4, 3, 2, 1, 1, 4]


def test_an_error_makes_room(free_slots: Callable[[], int]):
    for slot in (turns.reserve(3), turns.free_slot()):
        with pytest.raises(ValueError, match="broken"), slot:
            raise ValueError("broken")
    assert free_slots() == 4


def test_who_waits_goes_on_when_a_slot_is_free(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(turns.os, "cpu_count", lambda: 0)  # one slot

    def take() -> None:
        with turns.free_slot():
            pass

    thread = threading.Thread(target=take, daemon=True)
    with turns.free_slot():
        thread.start()
    thread.join(60.0)
    assert not thread.is_alive()
