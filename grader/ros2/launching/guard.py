"""Ensure that no process outlives the launch that started it, however the launch ends.

There are two safeguards. Each child asks the kernel to be killed when its parent dies (Linux: PR_SET_PDEATHSIG). That
does not reach the child's own children, so a small second process waits at the end of a pipe: when the launch is gone,
even by SIGKILL, it kills each child's whole process group and removes the temporary parameter files.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import shutil
import signal
from collections.abc import Callable
from pathlib import Path

PR_SET_PDEATHSIG = 1


def die_with_parent() -> Callable[[], None]:
    """Return the function that a child has to call before it becomes its command."""
    parent = os.getpid()
    try:
        prctl = ctypes.CDLL(None).prctl
    except (OSError, AttributeError):  # not Linux: only the guard is left
        return lambda: None

    def ask() -> None:
        prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() != parent:  # the parent died between fork and here
            os._exit(1)

    return ask


class Guard:
    """The process at the end of the pipe."""

    def __init__(self) -> None:
        reading, self._writing = os.pipe()
        self.pid = os.fork()
        if self.pid == 0:
            try:
                os.close(self._writing)
                _watch(reading)
            finally:
                os._exit(0)
        os.close(reading)

    def joining(self) -> Callable[[], None]:
        """Return what the leader of a new group has to call before it becomes its command.

        It registers its group itself: the launch may be gone before it can.
        """
        ask = die_with_parent()

        def join() -> None:
            ask()
            self.group(os.getpid())

        return join

    def group(self, pgid: int) -> None:
        """Register a process group to be killed at the end."""
        self._tell(f"group {pgid}")

    def folder(self, path: Path) -> None:
        """Register a folder to be removed at the end."""
        self._tell(f"folder {path}")

    def _tell(self, line: str) -> None:
        with contextlib.suppress(BrokenPipeError):
            os.write(self._writing, (line + "\n").encode())

    def close(self) -> None:
        """Kill and remove everything registered, and wait until it is gone."""
        os.close(self._writing)
        with contextlib.suppress(ChildProcessError):
            os.waitpid(self.pid, 0)


def _watch(reading: int) -> None:
    os.setsid()  # so that a terminal's Ctrl-C, or a signal to the launch's group, does not reach this process
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT):
        signal.signal(number, signal.SIG_IGN)
    nowhere = os.open(os.devnull, os.O_RDWR)
    for fd in (0, 1, 2):  # so that a reader of the launch's output does not wait for this process
        os.dup2(nowhere, fd)
    for name in os.listdir("/proc/self/fd") if Path("/proc/self/fd").is_dir() else ():  # noqa: PTH208 - names suffice
        if (fd := int(name)) > 2 and fd != reading:
            with contextlib.suppress(OSError):
                os.close(fd)
    with os.fdopen(reading, "rb") as pipe:
        orders = [line.decode().rstrip("\n").split(" ", 1) for line in pipe]
    for kind, value in orders:
        if kind == "group":
            with contextlib.suppress(ProcessLookupError, PermissionError):
                os.killpg(int(value), signal.SIGKILL)
        elif kind == "folder":
            shutil.rmtree(value, ignore_errors=True)
