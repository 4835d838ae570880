"""Keep a process started in advance: it has imported what it needs, and reads its task from standard input."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path


class SpareProcess:
    """At most one process that runs a Python module and waits for its task. Safe to use from several threads.

    It has a session of its own, so Ctrl-C does not reach it, and it sees the end of its input when this process ends.

    Args:
        arguments: of Python.
        path: a folder in which it looks for modules first.
        idle_s: after so many seconds a process that is not needed is ended, because it takes 30 MB of memory.
    """

    def __init__(self, arguments: Sequence[str], path: Path, idle_s: float) -> None:
        self._command = [sys.executable, *arguments]
        self._path, self._idle_s = path, idle_s
        self._lock = threading.Lock()
        self._waiting: subprocess.Popen[str] | None = None
        self._timer: threading.Timer | None = None
        self._began_in: tuple[dict[str, str], int, int] = ({}, 0, 0)

    def take(self) -> subprocess.Popen[str]:
        """Return a process that has begun in the present environment and folder: the one that waits, or a new one."""
        with self._lock:
            found, self._waiting = self._waiting, None
            if self._timer is not None:
                self._timer.cancel()
        if found is not None:
            if found.poll() is None and self._began_in == _surroundings():
                return found
            _end(found)
        return self._start()

    def prepare(self) -> None:
        """Start the process that the next `take` returns, unless one waits or this machine has no room for it."""
        with self._lock:
            if self._waiting is not None:
                return
            try:
                self._began_in, waiting = _surroundings(), self._start()
            except OSError:
                return
            self._waiting = waiting
            self._timer = threading.Timer(self._idle_s, self._give_up, [waiting])
            self._timer.daemon = True
            self._timer.start()

    def _give_up(self, waiting: subprocess.Popen[str]) -> None:
        with self._lock:
            if self._waiting is not waiting:
                return
            self._waiting = None
        _end(waiting)

    def _start(self) -> subprocess.Popen[str]:
        # Without empty parts, each of which would mean the current folder.
        path = [str(self._path), *filter(None, os.environ.get("PYTHONPATH", "").split(os.pathsep))]
        return subprocess.Popen(
            self._command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
            start_new_session=True,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(path)},
        )  # fmt: skip


def _surroundings() -> tuple[dict[str, str], int, int]:
    """Return the environment and the working folder: not its path, at which there may be another one by now."""
    here = Path().stat()
    return dict(os.environ), here.st_dev, here.st_ino


def _end(process: subprocess.Popen[str]) -> None:
    process.kill()
    with suppress(BrokenPipeError), process:  # which closes its pipes and waits
        pass
