"""Read running processes from /proc, and kill them."""

from __future__ import annotations

import contextlib
import os
import signal
import time
from collections.abc import Iterable
from pathlib import Path

_GONE_S, _PERIOD_S = 5.0, 0.005  # killed processes are gone at once, unless the kernel holds them


def children(pid: int) -> list[int]:
    """Return the pids whose parent is `pid`."""
    return [child for child, parent in _parents().items() if parent == pid]


def descendants(pid: int) -> list[int]:
    """Return the pids of all processes below `pid`."""
    parents = _parents()
    found, grown = {pid}, {pid}
    while grown:
        grown = {child for child, parent in parents.items() if parent in grown} - found
        found |= grown
    return sorted(found - {pid})


def descendants_at_a_glance(pid: int) -> list[int]:
    """Return the same in a twentieth of the time; one may be missing while another ends.

    Good enough for measuring, not for killing. See proc(5), /proc/PID/task/TID/children.
    """
    if not Path("/proc/self/task", str(os.getpid()), "children").exists():
        return descendants(pid)  # a kernel without CONFIG_PROC_CHILDREN
    found, left = set[int](), [pid]
    while left:
        for thread in _threads([left.pop()]):
            with contextlib.suppress(OSError):  # it has just ended
                children = {int(child) for child in (thread / "children").read_text().split()} - found
                found |= children
                left += children
    return sorted(found)


def thread_times(pids: Iterable[int]) -> dict[int, tuple[float, float]]:
    """Return for each thread the seconds that it has run, and the seconds that it has waited for a core."""
    found = {}
    for thread in _threads(pids):
        with contextlib.suppress(OSError, ValueError):  # it has just ended
            ran, waited, _ = (thread / "schedstat").read_text().split()
            found[int(thread.name)] = int(ran) * 1e-9, int(waited) * 1e-9
    return found


def count_threads(pids: Iterable[int]) -> int:
    """Return how many threads the processes have together, their first ones included."""
    return len(_threads(pids))


def cpu_seconds(pids: Iterable[int]) -> float:
    """Return the CPU time that the processes have used, together with those of their children that have ended."""
    ticks = 0
    for pid in pids:
        with contextlib.suppress(OSError):  # it has just ended
            ticks += sum(map(int, _status(pid)[11:15]))
    return ticks / os.sysconf("SC_CLK_TCK")


def exit_code(pid: int) -> int | None:
    """Return how a process has ended that its parent has not asked yet, negative for a signal; None if it is gone.

    See proc(5), /proc/PID/stat, exit_code.
    """
    try:
        return os.waitstatus_to_exitcode(int(_status(pid)[49]))
    except OSError:
        return None


def send(pid: int, number: signal.Signals) -> None:
    """Send a signal to a process, if it is still there."""
    with contextlib.suppress(ProcessLookupError):
        os.kill(pid, number)


def kill(pids: Iterable[int]) -> None:
    """Kill the processes and wait until none of them runs any more, at most a few seconds."""
    left = set(pids)
    for pid in left:
        send(pid, signal.SIGKILL)
    deadline = time.monotonic() + _GONE_S
    while (left := {pid for pid in left if runs(pid)}) and time.monotonic() < deadline:
        time.sleep(_PERIOD_S)


def runs(pid: int) -> bool:
    """Return whether a process runs: it may have ended already although nobody has asked for its exit status yet."""
    try:
        return _status(pid)[0] not in "ZX"
    except OSError:
        return False


def _threads(pids: Iterable[int]) -> list[Path]:
    found: list[Path] = []
    for pid in pids:
        with contextlib.suppress(OSError):  # it has just ended
            found += list(Path(f"/proc/{pid}/task").iterdir())
    return found


def _parents() -> dict[int, int]:
    """Return the parent's pid of each process."""
    found = {}
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            with contextlib.suppress(OSError):  # it has just ended
                found[int(entry.name)] = int(_status(int(entry.name))[1])
    return found


def _status(pid: int) -> list[str]:
    """Return the fields of /proc/PID/stat that follow the command's name."""
    # The name is in brackets and can hold any character, so count from the last bracket.
    return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
