"""A clock that counts no time in which other processes had the cores: a busy machine is no fault of a submission's."""

from __future__ import annotations

import os
import time
from collections.abc import Sequence
from typing import Protocol

from grader.host import procfs

_FRESH_S = 0.25
_NONE = (0.0, 0.0)


class Sharer(Protocol):
    """A command with all its processes, that shares the cores with others."""

    def thread_times(self) -> dict[int, tuple[float, float]]:
        """Return for each of its threads the seconds that it has run, and has waited for a core."""


class WorkClock:
    """Counts wall time, without that in which others had the cores that a command wanted.

    Args:
        process: the command.
        besides: pids of ours on which it waits, such as its observer's.
    """

    def __init__(self, process: Sharer, besides: Sequence[int] = ()) -> None:
        self._process, self._besides = process, besides
        self._before, self._since, self._counted = self._shares(), time.monotonic(), 0.0

    def look(self) -> float:
        """Return the seconds counted so far. It costs some milliseconds: all processes of the host are looked at."""
        shares, now = self._shares(), time.monotonic()
        gained = [
            (ran - self._before.get(thread, _NONE)[0], waited - self._before.get(thread, _NONE)[1])
            for thread, (ran, waited) in shares.items()
        ]
        ran, waited = sum(each for each, _ in gained), sum(each for _, each in gained)
        # Many that want to compute wait for each other; then what they compute is what counts.
        self._counted += max(now - self._since - waited, ran / (os.cpu_count() or 1))
        self._before, self._since = shares, now
        return self._counted

    def seconds(self) -> float:
        """Return the same, at most a quarter of a second old: cheap enough to be asked again and again."""
        return self.look() if time.monotonic() - self._since > _FRESH_S else self._counted

    def _shares(self) -> dict[int, tuple[float, float]]:
        return self._process.thread_times() | procfs.thread_times(self._besides)
