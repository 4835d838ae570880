"""Pin a multi-threaded node to one core while that makes it faster.

Python's threads take turns holding the GIL. On two cores each turn wakes the other core: a MultiThreadedExecutor that
runs at 7 times real time on one core was measured at 0.4 to 2 times real time on two idle ones. A single-threaded node
is faster when DDS's threads have a core of their own, so only slow nodes are pinned.
"""

from __future__ import annotations

import os
import random
from collections.abc import Callable, Iterable

_PERIOD = 20  # ticks that one measurement takes
_SLOW_S = 0.025  # of work a tick: half a tick of simulated time
_WORTHWHILE = 0.7  # of the work before pinning, at most


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
