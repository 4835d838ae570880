"""Decide which cores a trial runs on: observer and node together on one, in a notebook a slow node alone.

In lockstep, observer and node take turns. On two cores the first message of a tick wakes the node, which then spends a
round of its executor on that message alone; on one it runs once the observer has said everything and waits. That saves
a fifth of a trial's CPU time.

Python's threads take turns holding the GIL, too. On two cores each turn wakes the other core: a MultiThreadedExecutor
that runs at 7 times real time on one core was measured at 0.4 to 2 times real time on two idle ones.
"""

from __future__ import annotations

import contextlib
import os
import random
import threading
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

_PERIOD = 20  # ticks that one measurement takes
_SLOW_S = 0.025  # of work a tick: half a tick of simulated time
_WORTHWHILE = 0.7  # of the work before pinning, at most


class Cores:
    """The cores that trials may use, shared among those that run at the same time."""

    def __init__(self) -> None:
        self._used = Counter(dict.fromkeys(os.sched_getaffinity(0), 0))
        self._lock = threading.Lock()

    @contextlib.contextmanager
    def one(self) -> Iterator[int]:
        """Yield a core that is among those that the fewest trials use, one of them at random."""
        with self._lock:
            fewest = min(self._used.values())
            core = random.choice([core for core, trials in self._used.items() if trials == fewest])
            self._used[core] += 1
        try:
            yield core
        finally:
            with self._lock:
                self._used[core] -= 1


def take_turns(one_thread: bool) -> None:
    """Let this process, and a node with `one_thread` that it starts, go on when another thread on their core wakes up.

    A node with several threads is interrupted as usual: its MultiThreadedExecutor asks what is ready again and again
    while the thread that it has woken waits for the core. `check F1 F2 F4 F8` of such a node took minutes, not 9 s.
    """
    with contextlib.suppress(OSError):  # the order of a tick's messages is a matter of speed only
        os.sched_setscheduler(0, os.SCHED_BATCH if one_thread else os.SCHED_OTHER, os.sched_param(0))


def hear_at_once() -> None:
    """Let this process's threads that receive messages preempt whatever runs on their core.

    A node that ends destroys its publisher within a millisecond of its last message. The news of that arrives at
    another thread than the message, and if that is read first, the message is dropped: on one core, in two of three
    trials.
    """
    for task in Path("/proc/self/task").iterdir():
        with contextlib.suppress(OSError):  # a thread that has ended
            if not (task / "comm").read_text().startswith("dds.udp"):
                continue
            try:
                os.sched_setscheduler(int(task.name), os.SCHED_FIFO, os.sched_param(1))
            except PermissionError:
                os.sched_setscheduler(int(task.name), os.SCHED_OTHER, os.sched_param(0))


class AffinityTuner:
    """Measures a node every few ticks, pins it to one core if it is slow, and unpins it if that does not help.

    Args:
        pin_to: lets all the node's threads run on these cores only.
        clock: returns the seconds that the trial has worked so far.
    """

    def __init__(self, pin_to: Callable[[Iterable[int]], None], clock: Callable[[], float]) -> None:
        self._pin_to, self._clock = pin_to, clock
        self._cores = sorted(os.sched_getaffinity(0))
        self._before_pinning: float | None = None
        self._ticks = 0
        self._since = 0.0
        self._settled = len(self._cores) < 2

    def tick(self) -> None:
        """Note that a tick in lockstep is over."""
        if self._settled:
            return
        if self._ticks == 0:
            self._since = self._clock()
        self._ticks += 1
        if self._ticks > _PERIOD:
            self._decide((self._clock() - self._since) / _PERIOD)
            self._ticks = 0

    def _decide(self, seconds_a_tick: float) -> None:
        if self._before_pinning is not None:
            self._settled = True
            if seconds_a_tick > _WORTHWHILE * self._before_pinning:
                self._pin_to(self._cores)
        elif seconds_a_tick > _SLOW_S:
            self._before_pinning = seconds_a_tick
            self._pin_to([random.choice(self._cores)])
