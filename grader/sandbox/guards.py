"""Watch what a sandbox writes and whether the disk has space for it; and its processes, where no cgroup counts them."""

from __future__ import annotations

import contextlib
import os
import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from grader.host import procfs, shortage

_MAX_DEPTH = 200  # nested folders
_MAX_PATH = 3000  # bytes; nothing could be read by a path of more than 4096
_TOO_MANY = 1 << 62


class DiskGuard:
    """Stops a command that fills the disk below some folders. Checks now and then; more often when space runs low.

    The kernel has no limit on the total size of many files, and few hosts have disk quotas. A disk that is full before
    the limit is exceeded is the host's problem, whoever filled it: it had less space than the command was promised.
    """

    _POLL_S = 0.2
    _WALK_S = 2.0

    def __init__(self, folders: Sequence[Path], max_bytes: int, max_files: int, stop: Callable[[], None]) -> None:
        """Watch from now on. Call `stop` once the folders have grown by more than this, or the disk is full.

        In the first case `exceeded` is "disk"; in the second `host_full` is a sentence about this machine.
        """
        self.exceeded = self.host_full = ""
        self._folders, self._limits, self._stop = folders, (max_bytes, max_files), stop
        self._closed = threading.Event()
        self._before = _used(folders)
        self._thread = threading.Thread(target=self._watch, daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Check one last time and stop watching."""
        self._closed.set()
        self._thread.join()
        self._check()

    def _watch(self) -> None:
        free, walked = self._free(), time.monotonic()
        while not self._closed.wait(self._POLL_S):
            now = self._free()
            soon = now[0] < shortage.MIN_FREE_BYTES or any(
                before - after > limit // 8 for before, after, limit in zip(free, now, self._limits, strict=True)
            )
            if not soon and time.monotonic() - walked < self._WALK_S:
                continue
            free, walked = now, time.monotonic()
            if self._check():
                self._stop()
                return

    def _check(self) -> bool:
        """Record whether the limit is exceeded, or else the disk is full; return whether either is the case."""
        pairs = zip(_used(self._folders), self._before, self._limits, strict=True)
        if any(now - before > limit for now, before, limit in pairs):
            self.exceeded = "disk"
        if not self.exceeded and not self.host_full:
            self.host_full = shortage.explain_disk(self._folders[0])
        return bool(self.exceeded or self.host_full)

    def _free(self) -> tuple[int, int]:
        facts = os.statvfs(self._folders[0])
        return facts.f_bavail * facts.f_frsize, facts.f_favail


def _used(folders: Sequence[Path]) -> tuple[int, int]:
    """Return the size in bytes and the number of files below the folders, without following links.

    A folder that is nested too deep, or has too long a path, counts as too many files.
    """
    size = count = 0
    waiting = [(str(folder), 0) for folder in folders]
    while waiting:
        folder, depth = waiting.pop()
        if depth > _MAX_DEPTH or len(os.fsencode(folder)) > _MAX_PATH:
            return size, _TOO_MANY
        with contextlib.suppress(OSError), os.scandir(folder) as entries:
            for entry in entries:
                count += 1
                with contextlib.suppress(OSError):
                    if entry.is_dir(follow_symlinks=False):
                        waiting.append((entry.path, depth + 1))
                    else:
                        facts = entry.stat(follow_symlinks=False)
                        # A sparse file takes its full size as soon as it is copied.
                        size += max(facts.st_blocks * 512, facts.st_size)
    return size, count


class ProcessGuard:
    """Stops a command that has used up its processes.

    The kernel refuses it more of them (RLIMIT_NPROC), but those that it has already would keep every core of the
    machine busy until the command's time is over.
    """

    _POLL_S = 0.1
    # The kernel counts what starts and ends between two looks, too.
    _SHARE = 7 / 8

    def __init__(self, tree: Callable[[], Sequence[int]], limit: int, stop: Callable[[], None]) -> None:
        """Watch from now on the processes that `tree` returns.

        Once they have almost `limit` threads together, call `stop`, and `exceeded` is "processes".
        """
        self.exceeded = ""
        self._tree, self._most, self._stop = tree, self._SHARE * limit, stop
        self._closed = threading.Event()
        self._thread = threading.Thread(target=self._watch, daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop watching."""
        self._closed.set()
        self._thread.join()

    def _watch(self) -> None:
        while not self._closed.wait(self._POLL_S):
            if procfs.count_threads(self._tree()) >= self._most:
                self.exceeded = "processes"
                self._stop()
                return
