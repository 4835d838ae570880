"""Start nodes as forks of a process that has imported rclpy, where a grading has left one for the launch.

Without that, and where a fork would differ from a start of Python, nodes are started as usual.
"""

from __future__ import annotations

import contextlib
import ctypes
import json
import os
import re
import signal
import socket
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

VARIABLE = "ROS2_COURSE_KIT_FORKS"
"""Names the file descriptor at which to ask for a fork."""
_SUBREAPER = 36  # PR_SET_CHILD_SUBREAPER in <linux/prctl.h>
_FIRST_LINE = re.compile(rb"#! ?/usr/bin/env python3[ \t]*\n")
_MESSAGE_BYTES = 60_000


def _channel() -> socket.socket | None:
    number = os.environ.pop(VARIABLE, "")
    with contextlib.suppress(OSError, ValueError):
        found = socket.socket(fileno=int(number))
        found.set_inheritable(False)
        return found
    return None


_CHANNEL = _channel()
_ENVIRONMENT = dict(os.environ)
_LOADED = {name.split(".")[0] for name in sys.modules} - {"__main__"}


class Forked:
    """A running program, with the part of subprocess.Popen's interface that a launch needs."""

    def __init__(self, pid: int, stdin: int) -> None:
        self.pid = pid
        self.stdin = os.fdopen(stdin, "wb")
        self.returncode: int | None = None

    def poll(self) -> int | None:
        """Return the exit status, negative for a signal, or None while it runs."""
        if self.returncode is None:
            try:
                pid, status = os.waitpid(self.pid, os.WNOHANG)
            except ChildProcessError:  # a launch file has waited for it; subprocess says 0, too
                pid, status = self.pid, 0
            self.returncode = os.waitstatus_to_exitcode(status) if pid else None
        return self.returncode

    def send_signal(self, number: signal.Signals) -> None:
        """Send a signal, unless it has ended."""
        if self.poll() is None:
            os.kill(self.pid, number)


def start(
    cmd: Sequence[str], environment: Mapping[str, str], cwd: str | None, stdout: int, stderr: int
) -> Forked | None:
    """Start a Python program as a fork, a child of this process in a session of its own that dies with it.

    Return None if there is nothing to fork, or if the program would not be started as this process was.
    """
    if _CHANNEL is None or environment != _ENVIRONMENT or not _finds_the_same_modules(Path(cmd[0])):
        return None
    request = json.dumps(
        {"command": list(cmd), "cwd": cwd or str(Path.cwd()), "environment": dict(environment)}
    ).encode()
    if len(request) > _MESSAGE_BYTES:
        return None
    prctl = ctypes.CDLL(None).prctl
    theirs, ours = os.pipe()
    try:
        # Its parent ends before it begins, and it becomes a child of its nearest ancestor that takes in orphans.
        prctl(_SUBREAPER, 1, 0, 0, 0)
        socket.send_fds(_CHANNEL, [request], [theirs, stdout, stderr])
        pid = int(_CHANNEL.recv(20) or 0)
    except (OSError, ValueError):
        pid = 0
    finally:
        prctl(_SUBREAPER, 0, 0, 0, 0)
        os.close(theirs)
    if pid:
        return Forked(pid, ours)
    os.close(ours)
    return None


def _finds_the_same_modules(script: Path) -> bool:
    """Return whether this Python would run the file, and nothing beside it hides a module that is loaded already."""
    try:
        with script.open("rb") as file:
            is_python = _FIRST_LINE.match(file.readline(200)) is not None
        beside = {name.split(".")[0] for name in os.listdir(script.resolve().parent)}  # noqa: PTH208 - names suffice
    except OSError:
        return False
    return is_python and script.is_absolute() and os.access(script, os.X_OK) and not beside & _LOADED
