"""A node that crawls on several cores is held to one, for as long as that helps. Nobody else is held."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable

import pytest

from grader.sandbox import Limits, Process, Sandbox
from grader.trials.cpu_affinity import AffinityTuner

CORES = [0, 1, 2, 3]


class Node:
    """A node that takes `alone` seconds of work a tick on one core, and `spread` on several."""

    def __init__(self, spread: float, alone: float) -> None:
        self.spread, self.alone = spread, alone
        self.cores, self.seconds, self.times_held = len(CORES), 0.0, 0

    def pin_to(self, cores: Iterable[int]) -> None:
        self.cores = len(list(cores))
        self.times_held += self.cores == 1

    def run(self, ticks: int) -> None:
        one_core = AffinityTuner(self, lambda: self.seconds)
        for _ in range(ticks):
            self.seconds += self.alone if self.cores == 1 else self.spread
            one_core.tick()


@pytest.fixture(autouse=True)
def four_cores(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(os, "sched_getaffinity", lambda _pid: set(CORES))


def test_a_node_that_crawls_on_several_cores_is_held_to_one():
    node = Node(spread=0.120, alone=0.007)
    node.run(200)
    assert (node.cores, node.times_held) == (1, 1)


def test_a_node_that_crawls_on_one_core_too_is_let_go_for_good():
    node = Node(spread=0.120, alone=0.110)
    node.run(200)
    assert (node.cores, node.times_held) == (4, 1)


def test_a_node_that_keeps_up_is_never_held():
    node = Node(spread=0.005, alone=0.001)
    node.run(200)
    assert node.times_held == 0


def test_nobody_is_held_where_there_is_one_core_only(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(os, "sched_getaffinity", lambda _pid: {2})
    node = Node(spread=0.120, alone=0.007)
    node.run(200)
    assert node.times_held == 0


@pytest.mark.sandbox
@pytest.mark.skipif((os.cpu_count() or 1) < 2, reason="needs two cores")
def test_a_whole_wall_is_held_with_the_threads_that_it_starts_later(monkeypatch: pytest.MonkeyPatch):
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
