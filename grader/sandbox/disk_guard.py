"""Watch how much is put below some folders, and whether the disk has room for it."""

from __future__ import annotations

import contextlib
import os
import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from grader.host import shortage

_DEEPEST = 200  # folders in folders: below four thousand characters of a path nobody could count any more
_TOO_MANY = 1 << 62


class Guard:
    """Ends what fills the disk below some folders. Looks now and then; more often when space dwindles.

    No limit of the kernel counts what many files take together, and a quota is nothing that one finds on every host.
    A disk that is full before the limit is met is the host's fault, whoever filled it: less was there than promised.
    """

    _LOOK_S = 0.2
    _WALK_S = 2.0

    def __init__(self, folders: Sequence[Path], most_bytes: int, most_files: int, end: Callable[[], None]) -> None:
        """Watch from now on, and call `end` when more has been added below the folders than this, or no room is left.

        `met` is then "disk", or else `host_is_full` says in words what is the matter with this machine.
        """
        self.met = self.host_is_full = ""
        self._folders, self._caps, self._end = folders, (most_bytes, most_files), end
        self._over = threading.Event()
        self._before = _used(folders)
        self._thread = threading.Thread(target=self._watch, daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Look a last time, and no more."""
        self._over.set()
        self._thread.join()
        self._look()

    def _watch(self) -> None:
        free, walked = self._free(), time.monotonic()
        while not self._over.wait(self._LOOK_S):
            now = self._free()
            soon = now[0] < shortage.LITTLE_ROOM or any(
                before - after > limit // 8 for before, after, limit in zip(free, now, self._caps, strict=True)
            )
            if not soon and time.monotonic() - walked < self._WALK_S:
                continue
            free, walked = now, time.monotonic()
            if self._look():
                self._end()
                return

    def _look(self) -> bool:
        """Note whether the limit is met, or else the disk full. Return whether either is so."""
        if not self.met and self._too_much():
            self.met = "disk"
        if not self.met and not self.host_is_full:
            self.host_is_full = shortage.full(self._folders[0])
        return bool(self.met or self.host_is_full)

    def _free(self) -> tuple[int, int]:
        facts = os.statvfs(self._folders[0])
        return facts.f_bavail * facts.f_frsize, facts.f_favail

    def _too_much(self) -> bool:
        pairs = zip(_used(self._folders), self._before, self._caps, strict=True)
        return any(now - before > cap for now, before, cap in pairs)


def _used(folders: Sequence[Path]) -> tuple[int, int]:
    """Return the bytes and the number of files below the folders, links not followed; too deep are too many."""
    size = count = 0
    waiting = [(str(folder), 0) for folder in folders]
    while waiting:
        folder, depth = waiting.pop()
        if depth > _DEEPEST:
            return size, _TOO_MANY
        with contextlib.suppress(OSError), os.scandir(folder) as entries:
            for entry in entries:
                count += 1
                with contextlib.suppress(OSError):
                    if entry.is_dir(follow_symlinks=False):
                        waiting.append((entry.path, depth + 1))
                    else:
                        facts = entry.stat(follow_symlinks=False)
                        # A file with holes takes its whole size as soon as somebody copies it.
                        size += max(facts.st_blocks * 512, facts.st_size)
    return size, count
