"""A clock that excludes time spent waiting for a CPU, so that a busy machine is never held against a submission."""

from __future__ import annotations

import os
import time
from collections.abc import Sequence
from typing import Protocol

from grader.host import procfs

_MAX_AGE_S = 0.5
_NEW_THREAD = (0.0, 0.0)


class Timed(Protocol):
    """A command whose threads' times can be read."""

    def thread_times(self) -> dict[int, tuple[float, float]]:
        """Return for each thread the seconds that it has run, and the seconds that it has waited for a core."""

    def cpu_seconds(self) -> float:
        """Return the CPU time that all its processes have used, those that have ended included."""


class CpuClock:
    """Counts wall time since its creation, without the time in which a command waited for a CPU.

    Args:
        process: the command.
        others: pids of the grader's own processes on which the command waits, such as its observer.
    """

    def __init__(self, process: Timed, others: Sequence[int] = ()) -> None:
        self._process, self._others = process, others
        self._before, self._since, self._counted = self._thread_times(), time.monotonic(), 0.0
        self._used = self._cpu_seconds()
        self.ran = 0.0
        """The seconds that the command and the others ran so far, all threads together, at the last reading."""
        self.idle = 0.0
        """Those in which nothing of them ran or waited for a CPU: they waited for something else."""

    def read(self) -> float:
        """Return the seconds counted so far. Takes some milliseconds: it looks at all processes of the host."""
        times, used, now = self._thread_times(), self._cpu_seconds(), time.monotonic()
        gained = [
            (ran - self._before.get(thread, _NEW_THREAD)[0], waited - self._before.get(thread, _NEW_THREAD)[1])
            for thread, (ran, waited) in times.items()
        ]
        ran, waited = sum(each for each, _ in gained), sum(each for _, each in gained)
        # Many computing threads wait for each other; then the time that they ran is what counts. A compiler's processes
        # live for a second or two, and what they ran after the last reading is seen in their parents' times only.
        ran = max(ran, used - self._used)
        self.ran += ran
        self.idle += max(now - self._since - waited - ran, 0.0)
        self._counted += max(now - self._since - waited, ran / (os.cpu_count() or 1))
        self._before, self._since, self._used = times, now, max(self._used, used)
        return self._counted

    def seconds(self) -> float:
        """Return the same, up to half a second old: cheap enough to be called again and again."""
        return self.read() if time.monotonic() - self._since > _MAX_AGE_S else self._counted

    def _thread_times(self) -> dict[int, tuple[float, float]]:
        return self._process.thread_times() | procfs.thread_times(self._others)

    def _cpu_seconds(self) -> float:
        return self._process.cpu_seconds() + procfs.cpu_seconds(self._others)
