"""Hold a node with several threads to one core while that makes it faster.

Threads of Python take turns by one lock. On two cores each turn wakes the other core up: a MultiThreadedExecutor that
does 7 times real time on one core was measured at 0.4 to 2 times real time on two idle ones. A node with one thread is
faster when the threads of DDS have a core besides, so nobody is held who does not crawl.
"""

from __future__ import annotations

import os
import random
from collections.abc import Callable, Iterable
from typing import Protocol

_TICKS = 20  # make one look
_CRAWLS_S = 0.025  # of work a tick: half a tick of simulated time
_WORTH_IT = 0.7  # of the work before


class Holdable(Protocol):
    """A command with all its processes."""

    def pin_to(self, cores: Iterable[int]) -> None:
        """Let them run on these cores only."""


class OneCore:
    """Looks at a node every few ticks, holds it to one core when it crawls, and lets it go if that does not help.

    Args:
        process: the node's.
        clock: the seconds that the trial has worked so far.
    """

    def __init__(self, process: Holdable, clock: Callable[[], float]) -> None:
        self._process, self._clock = process, clock
        self._cores = sorted(os.sched_getaffinity(0))
        self._before: float | None = None
        self._ticks = 0
        self._since = 0.0
        self._settled = len(self._cores) < 2

    def tick(self) -> None:
        """Take note that a tick in lockstep is over."""
        if self._settled:
            return
        if self._ticks == 0:
            self._since = self._clock()
        self._ticks += 1
        if self._ticks > _TICKS:
            self._look((self._clock() - self._since) / _TICKS)
            self._ticks = 0

    def _look(self, seconds: float) -> None:
        if self._before is not None:
            self._settled = True
            if seconds > _WORTH_IT * self._before:
                self._process.pin_to(self._cores)
        elif seconds > _CRAWLS_S:
            self._before = seconds
            self._process.pin_to([random.choice(self._cores)])
