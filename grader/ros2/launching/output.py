"""What a launch prints and writes to its log folder, in the words of the real one."""

from __future__ import annotations

import contextlib
import os
import re
import socket
import sys
import time
from pathlib import Path
from typing import Any

CHANNELS = ("stdout", "stderr", "both")
# The words that `output=` knows, as what goes where.
KINDS: dict[str, dict[str, set[str]]] = {
    "screen": {"both": {"screen"}},
    "log": {"both": {"log"}, "stderr": {"screen"}},
    "both": {"both": {"screen", "log"}},
    "own_log": {"both": {"own_log"}, "stdout": {"own_log"}, "stderr": {"own_log"}},
    "full": {"both": {"screen", "log", "own_log"}, "stdout": {"own_log"}, "stderr": {"own_log"}},
}


def routes(output: Any) -> dict[str, set[str]]:
    """Return where each of stdout, stderr and both goes: screen, log, own_log.

    `OVERRIDE_LAUNCH_PROCESS_OUTPUT` in the environment wins over what the launch file says.
    """
    output = os.environ.get("OVERRIDE_LAUNCH_PROCESS_OUTPUT") or output
    if isinstance(output, str):
        if output not in KINDS:
            raise ValueError(f"'{output}' is not a valid standard output config i.e. one of: {', '.join(KINDS)}")
        chosen: dict[str, Any] = KINDS[output]
    else:
        chosen = dict(output)
        if unknown := chosen.keys() - set(CHANNELS):
            raise ValueError(f"{sorted(unknown)} are no channels of a process: {', '.join(CHANNELS)}")
    found: dict[str, set[str]] = {}
    for channel, places in chosen.items():
        found[channel] = {places} if isinstance(places, str) else set(places)
        if wrong := found[channel] - {"screen", "log", "own_log"}:
            raise ValueError(f"{sorted(wrong)} are no places for a process's output: screen, log, own_log")
    return found


def log_root() -> Path:
    """Return the folder that holds all runs' log folders."""
    if root := os.environ.get("ROS_LOG_DIR"):
        return Path(root).expanduser()
    return Path(os.environ.get("ROS_HOME", "~/.ros")).expanduser() / "log"


class Output:
    """The screen and the log folder of one run."""

    def __init__(self, *, debug: bool = False) -> None:
        self.debug_wanted = debug
        stamp = time.strftime("%Y-%m-%d-%H-%M-%S")
        self.folder = log_root() / f"{stamp}-{time.time_ns() // 1000 % 10**6:06d}-{socket.gethostname()}-{os.getpid()}"
        self._files: dict[str, Any] = {}
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            self.warn("launch", f"no log files are written: {self.folder}: {error.strerror}")

    def begin(self) -> None:
        """Say where the log files are."""
        self.info("launch", f"All log files can be found below {self.folder}")
        self.info("launch", f"Default logging verbosity is set to {'DEBUG' if self.debug_wanted else 'INFO'}")

    def info(self, name: str, text: str) -> None:
        """Print an information."""
        self._say("INFO", name, text)

    def warn(self, name: str, text: str) -> None:
        """Print a warning."""
        self._say("WARNING", name, text)

    def error(self, name: str, text: str) -> None:
        """Print an error."""
        self._say("ERROR", name, text)

    def debug(self, name: str, text: str) -> None:
        """Print a detail, if details are asked for."""
        if self.debug_wanted:
            self._say("DEBUG", name, text)

    def _say(self, level: str, name: str, text: str) -> None:
        self._print(f"[{level}] [{name}]: {text}")
        self._log("launch", f"{time.time():.7f} [{level}] [{name}]: {text}")

    def lines(self, label: str, channel: str, places: dict[str, set[str]], lines: list[str], form: str) -> None:
        """Print and log lines of a process."""
        here = places.get(channel, set()) | places.get("both", set())
        for line in lines:
            if "screen" in here:
                self._print(form.format(line=line, this=_Named(label)))
            if "log" in here:
                self._log("launch", f"{time.time():.7f} [{label}] {line}")
        if "own_log" in here:
            for kind in (channel, "both"):
                if "own_log" in places.get(kind, set()):
                    for line in lines:
                        self._log(f"{label}-{'stdout_and_stderr' if kind == 'both' else kind}", line)

    def _print(self, line: str) -> None:
        try:
            print(line, flush=True)
        except OSError:  # the reader or the terminal has gone; the nodes go on until they are told to stop
            sys.stdout = open(os.devnull, "w")  # noqa: PTH123, SIM115 - stays open for the rest of the run

    def _log(self, name: str, line: str) -> None:
        if name not in self._files:
            try:
                self._files[name] = (self.folder / f"{re.sub('[^a-zA-Z0-9_.-]', '_', name)}.log").open("a", buffering=1)
            except OSError:
                self._files[name] = None
        if (file := self._files[name]) is not None:
            with contextlib.suppress(OSError):  # a full disk must not keep a launch from ending its nodes
                file.write(line + "\n")

    def close(self) -> None:
        """Close the log files."""
        for file in self._files.values():
            if file is not None:
                file.close()
        self._files.clear()


class _Named:
    """What `{this.process_description.final_name}` in an output format finds."""

    def __init__(self, final_name: str) -> None:
        self.final_name = self.name = final_name
        self.process_description = self
