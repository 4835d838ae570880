"""Where a launch writes: the screen and the log folder, in the words of the real one, and a record for machines."""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging
import os
import socket
import sys
import time
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

RECORD_VARIABLE = "ROS2_LAUNCH_RECORD"

CHANNELS = ("stdout", "stderr", "both")
# The values of `output=`, as what goes where. Processes have no logs of their own: their lines are in the launch's.
KINDS: dict[str, dict[str, set[str]]] = {
    "screen": {"both": {"screen"}},
    "log": {"both": {"log"}, "stderr": {"screen"}},
    "both": {"both": {"screen", "log"}},
    "own_log": {"both": {"log"}},
    "full": {"both": {"screen", "log"}},
}


def routes(output: Any) -> dict[str, set[str]]:
    """Return where each of stdout, stderr and both goes: screen, log, own_log (which is the log)."""
    if isinstance(output, str):
        if output not in KINDS:
            raise ValueError(f"'{output}' is not a valid standard output config i.e. one of: {', '.join(KINDS)}")
        chosen: dict[str, Any] = KINDS[output]
    else:
        chosen = dict(output)
        if unknown := chosen.keys() - set(CHANNELS):
            raise ValueError(f"a process has the channels {', '.join(CHANNELS)}, not {', '.join(sorted(unknown))}")
    found: dict[str, set[str]] = {}
    for channel, places in chosen.items():
        found[channel] = {places} if isinstance(places, str) else set(places)
        if wrong := found[channel] - {"screen", "log", "own_log"}:
            raise ValueError(f"output goes to screen, log or own_log, not to {', '.join(sorted(wrong))}")
    return found


class Output:
    """The screen and the log folder of one launch."""

    def __init__(self, *, debug: bool = False) -> None:
        self.debug_wanted = debug
        stamp = time.strftime("%Y-%m-%d-%H-%M-%S")
        name = f"{stamp}-{time.time_ns() // 1000 % 10**6:06d}-{socket.gethostname()}-{os.getpid()}"
        self.folder = log_root() / name
        self._file: Any = None
        _handler.output = self
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            self._file = (self.folder / "launch.log").open("a", buffering=1)
        except OSError as error:
            self.warn("launch", f"no log files are written: {self.folder}: {error.strerror}")

    def begin(self) -> None:
        """Print where the log files are."""
        self.info("launch", f"All log files can be found below {self.folder}")
        self.info("launch", f"Default logging verbosity is set to {'DEBUG' if self.debug_wanted else 'INFO'}")

    def info(self, name: str, text: str) -> None:
        self._say("INFO", name, text)

    def warn(self, name: str, text: str) -> None:
        self._say("WARNING", name, text)

    def error(self, name: str, text: str) -> None:
        self._say("ERROR", name, text)

    def debug(self, name: str, text: str) -> None:
        if self.debug_wanted:
            self._say("DEBUG", name, text)

    def _say(self, level: str, name: str, text: str) -> None:
        self._print(f"[{level}] [{name}]: {text}")
        self._log(f"{time.time():.7f} [{level}] [{name}]: {text}")

    def lines(self, label: str, channel: str, places: dict[str, set[str]], lines: list[str]) -> None:
        """Print and log lines of a process with its label; `places` says where each channel goes, as `routes` does."""
        here = places.get(channel, set()) | places.get("both", set())
        for line in lines:
            if "screen" in here:
                self._print(f"[{label}] {line}")
            if here & {"log", "own_log"}:
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

    def close(self) -> None:
        """Close the log file."""
        if _handler.output is self:
            _handler.output = None
        if self._file is not None:
            self._file.close()
            self._file = None


class _Handler(logging.Handler):
    """Passes on what a launch file logs: to the screen, and to the log file once the launch has one."""

    output: Output | None = None

    def emit(self, record: logging.LogRecord) -> None:
        text = record.getMessage() + (f"\n{record.exc_text or traceback.format_exc()}" if record.exc_info else "")
        if self.output is not None:
            self.output._say(record.levelname, record.name, text)
        else:
            print(f"[{record.levelname}] [{record.name}]: {text}", flush=True)


_handler = _Handler()


def get_logger(name: str | None = None) -> logging.Logger:
    """Return a logger that writes as the launch does: `launch.logging.get_logger`."""
    logger = logging.getLogger(name)
    if _handler not in logger.handlers:
        logger.addHandler(_handler)
        logger.setLevel(logging.DEBUG if _handler.output is not None and _handler.output.debug_wanted else logging.INFO)
        logger.propagate = False
    return logger


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

    def close(self) -> None:
        if self._file is not None:
            self._file.close()
            self._file = None


class LineReader:
    """Reads a file descriptor in an event loop, cuts what arrives into lines, and closes it at its end.

    `written` is called with the bytes that have arrived and the complete lines in them.
    """

    def __init__(self, fd: int, loop: asyncio.AbstractEventLoop, written: Callable[[bytes, list[str]], None]) -> None:
        self._fd, self._loop, self._written, self._rest, self.closed = fd, loop, written, b"", False
        os.set_blocking(fd, False)
        loop.add_reader(fd, self._read)

    def _read(self) -> bool:
        """Pass on what has arrived; return whether there may be more already."""
        try:
            text = os.read(self._fd, 65536)
        except BlockingIOError:
            return False
        except OSError:  # a terminal whose other end is closed
            text = b""
        if not text:
            self._flush()
            self._loop.remove_reader(self._fd)
            os.close(self._fd)
            self.closed = True
            return False
        *lines, self._rest = (self._rest + text).split(b"\n")
        self._written(text, [_decode(line) for line in lines])
        return True

    def drain(self) -> None:
        """Pass on everything that has arrived, with a last line that has no end."""
        while not self.closed and self._read():
            pass
        self._flush()

    def _flush(self) -> None:
        if self._rest:
            rest, self._rest = self._rest, b""
            self._written(b"", [_decode(rest)])


def _decode(line: bytes) -> str:
    return line.decode(errors="replace").rstrip("\r")
