"""Choose the cores of a trial: one core for observer and node in a grading, one for a slow node in a notebook.

In lockstep, observer and node alternate. On two cores the first message of a tick already wakes the node, and its
executor spends a whole round on that message. On one core the node runs after the observer has sent all messages of
the tick, which saves a fifth of the trial's CPU time.

Threads of Python alternate, too, because of the GIL. On two cores each change wakes the other core: a
MultiThreadedExecutor ran at 7 times real time on one core, and at 0.4 to 2 times real time on two idle cores.
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
    """The cores for trials, with the number of trials that run on each now."""

    def __init__(self) -> None:
        self._used = Counter(dict.fromkeys(os.sched_getaffinity(0), 0))
        self._lock = threading.Lock()

    @contextlib.contextmanager
    def one(self) -> Iterator[int]:
        """Yield a core that the fewest trials use; of several, a random one."""
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
    """Use SCHED_BATCH for a node with one thread, so that waking a thread does not preempt this process or the node.

    A node with several threads keeps the usual policy: its MultiThreadedExecutor polls while the thread that it has
    woken waits for the core. With SCHED_BATCH, `check F1 F2 F4 F8` of such a node took minutes instead of 9 s.
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
    """Measures the work of a trial per tick, pins a slow node to one core, and unpins it if that does not help.

    Args:
        pin_to: restricts all threads of the node to the given cores.
        clock: returns for how many seconds the trial has worked so far.
    """

    def __init__(self, pin_to: Callable[[Iterable[int]], None], clock: Callable[[], float]) -> None:
        self._pin_to, self._clock = pin_to, clock
        self._cores = sorted(os.sched_getaffinity(0))
        self._before_pinning: float | None = None
        self._ticks = 0
        self._since = 0.0
        self._settled = len(self._cores) < 2

    def tick(self) -> None:
        """Count a tick in lockstep that has ended; decide once enough of them have been measured."""
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
