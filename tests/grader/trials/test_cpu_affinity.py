"""Trials share the cores evenly; a node that is slow on several cores is pinned to one, for as long as that helps."""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Iterable

import pytest

from grader.sandbox import Limits, Process, Sandbox
from grader.trials.cpu_affinity import AffinityTuner, Cores

CORES = [0, 1, 2, 3]


class Node:
    """A node that takes `pinned` seconds of work a tick on one core, and `spread` on several."""

    def __init__(self, spread: float, pinned: float) -> None:
        self.spread, self.pinned = spread, pinned
        self.cores, self.seconds, self.times_pinned = len(CORES), 0.0, 0

    def pin_to(self, cores: Iterable[int]) -> None:
        self.cores = len(list(cores))
        self.times_pinned += self.cores == 1

    def run(self, ticks: int) -> None:
        tuner = AffinityTuner(self.pin_to, lambda: self.seconds)
        for _ in range(ticks):
            self.seconds += self.pinned if self.cores == 1 else self.spread
            tuner.tick()


@pytest.fixture(autouse=True)
def four_cores(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(os, "sched_getaffinity", lambda _pid: set(CORES))


def test_trials_that_run_at_the_same_time_share_the_cores_evenly():
    cores = Cores()
    with contextlib.ExitStack() as running:
        assert sorted(running.enter_context(cores.one()) for _ in CORES) == CORES
        with cores.one() as shared:
            assert sorted([shared, *(running.enter_context(cores.one()) for _ in CORES[1:])]) == CORES
        assert running.enter_context(cores.one()) == shared


def test_a_node_that_is_slow_on_several_cores_is_pinned_to_one():
    node = Node(spread=0.120, pinned=0.007)
    node.run(200)
    assert (node.cores, node.times_pinned) == (1, 1)


def test_a_node_that_is_slow_on_one_core_too_is_unpinned_for_good():
    node = Node(spread=0.120, pinned=0.110)
    node.run(200)
    assert (node.cores, node.times_pinned) == (4, 1)


def test_a_node_that_keeps_up_is_never_pinned():
    node = Node(spread=0.005, pinned=0.001)
    node.run(200)
    assert node.times_pinned == 0


def test_no_node_is_pinned_where_there_is_only_one_core(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(os, "sched_getaffinity", lambda _pid: {2})
    node = Node(spread=0.120, pinned=0.007)
    node.run(200)
    assert node.times_pinned == 0


@pytest.mark.sandbox
@pytest.mark.skipif((os.cpu_count() or 1) < 2, reason="needs two cores")
def test_threads_that_a_pinned_sandbox_starts_later_are_pinned_too(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.undo()
    later = (
        "import os, threading, time\n"
        "while len(os.sched_getaffinity(0)) > 1: time.sleep(0.01)\n"
        "seen = []\n"
        "threads = [threading.Thread(target=lambda: seen.append(os.sched_getaffinity(0))) for _ in range(3)]\n"
        "[t.start() for t in threads], [t.join() for t in threads]\n"
        "print(seen)\n"
    )
    core = max(os.sched_getaffinity(0))
    with Process([sys.executable, "-c", later], Sandbox(), Limits(wall_seconds=60)) as process:
        while process.exit_code() is None:
            process.pin_to([core])
    assert process.output.strip() == str([{core}] * 3)
