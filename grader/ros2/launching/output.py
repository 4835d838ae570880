"""Where a launch writes: the screen and the log folder, in the words of the real one, and a record for machines."""

from __future__ import annotations

import contextlib
import json
import os
import socket
import sys
import time
from functools import partialmethod
from pathlib import Path
from typing import Any

KINDS = ("screen", "log", "both", "own_log", "full")
"""The values of `output=`. Processes have no logs of their own: their lines are in the launch's."""


class Output:
    """The screen and the log folder of one launch."""

    def __init__(self) -> None:
        stamp = time.strftime("%Y-%m-%d-%H-%M-%S")
        name = f"{stamp}-{time.time_ns() // 1000 % 10**6:06d}-{socket.gethostname()}-{os.getpid()}"
        self.folder = log_root() / name
        self._file: Any = None
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            self._file = (self.folder / "launch.log").open("a", buffering=1)
        except OSError as error:
            self.warn("launch", f"no log files are written: {self.folder}: {error.strerror}")
        self.info("launch", f"All log files can be found below {self.folder}")
        self.info("launch", "Default logging verbosity is set to INFO")

    def _say(self, level: str, name: str, text: str) -> None:
        if level != "DEBUG":
            self._print(f"[{level}] [{name}]: {text}")
        self._log(f"{time.time():.7f} [{level}] [{name}]: {text}")

    debug, info = partialmethod(_say, "DEBUG"), partialmethod(_say, "INFO")
    warn, error = partialmethod(_say, "WARNING"), partialmethod(_say, "ERROR")

    def lines(self, label: str, kind: str, error: bool, lines: list[str]) -> None:
        """Print and log lines of a process with its label; `kind` is the value of `output=`."""
        for line in lines:
            if kind in ("screen", "both", "full") or (kind == "log" and error):
                self._print(f"[{label}] {line}")
            if kind != "screen":
                self._log(f"{time.time():.7f} [{label}] {line}")

    def _print(self, line: str) -> None:
        try:
            print(line, flush=True)
        except OSError:  # the reader or the terminal is gone; the nodes go on until they are stopped
            sys.stdout = open(os.devnull, "w")  # noqa: PTH123, SIM115 - stays open for the rest of the launch

    def _log(self, line: str) -> None:
        if self._file is not None:
            with contextlib.suppress(OSError):  # a full disk must not keep a launch from ending its nodes
                self._file.write(line + "\n")


def log_root() -> Path:
    """Return the folder that holds the log folders of all launches."""
    if root := os.environ.get("ROS_LOG_DIR"):
        return Path(root).expanduser()
    return Path(os.environ.get("ROS_HOME", "~/.ros")).expanduser() / "log"


class Record:
    """A record of the launch for machines: one JSON object per line and event, written as it happens.

    The launch file is its author's code and runs in the same process: the record is a help, not evidence against the
    author.
    """

    def __init__(self, path: Path | None) -> None:
        self._file = None if path is None else path.open("a", buffering=1, encoding="utf-8")

    def add(self, event: str, **facts: Any) -> None:
        """Write one event: `started` and `ended` for each process, `launch_ended` last."""
        if self._file is not None:
            self._file.write(json.dumps({"event": event, "time_s": round(time.time(), 3), **facts}) + "\n")
