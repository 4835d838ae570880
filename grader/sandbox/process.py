"""Run one command walled in. The only place that starts processes of a submission.

A wall is made by bubblewrap: the system read-only, a private /tmp and home, own pid, ipc, user and host name, the
network either cut or that of the caller's own namespace, limits on time, memory, processes, files and output. When a
walled-in process is stopped, its whole tree is gone before anything it left behind is read.
"""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from types import TracebackType

from grader.errors import GraderError
from grader.host import cgroup, procfs, shortage
from grader.sandbox import disk_guard
from grader.sandbox.bwrap import BEHIND_GATE, Limits, Sandbox, bwrap_command, in_cgroup, with_limits
from grader.sandbox.cpu_clock import WorkClock

_LOOKS_EVERY_S = 1.0  # at how long a command has waited for a core


_LONGEST = 4  # times its time limit a command may take on a machine that is busy with others


@dataclass(frozen=True)
class RunResult:
    """How a command ended. `exit_code` is negative for a signal, None if it had to be stopped for its time.

    `stopped` names the limit of the whole wall that it met: "memory", "processes", "disk" or "".
    """

    exit_code: int | None
    output: str
    timed_out: bool
    wall_seconds: float
    stopped: str = ""

    @property
    def ok(self) -> bool:
        """Return whether the command ended by itself with status 0."""
        return self.exit_code == 0


class Process:
    """A walled-in process that runs. Use as a context manager: leaving it ends the whole tree."""

    def __init__(self, command: Sequence[str], box: Sandbox, limits: Limits) -> None:
        self._limits = limits
        self.started = time.monotonic()
        self._group = cgroup.make(limits.resident_bytes, limits.processes)
        read_end, write_end = os.pipe()
        gate, opener = os.pipe()
        walled = [*bwrap_command(box, info_fd=write_end), *BEHIND_GATE, *with_limits(command, limits)]
        try:
            self._popen = subprocess.Popen(
                [*in_cgroup(self._group), *walled],
                stdin=gate,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                pass_fds=(write_end,),
                env={"PATH": os.environ.get("PATH", "/usr/bin:/bin")},
                start_new_session=True,
            )
        except OSError as error:
            os.close(read_end)
            os.close(opener)
            self._group.close()
            raise GraderError(f"Cannot start bwrap ({error}). Run `grader doctor`; it says how to mend it.") from error
        finally:
            os.close(write_end)
            os.close(gate)
        self._output = _Output(self._popen, limits.output_bytes)
        self._init_pid = _child_pid(read_end)
        with contextlib.suppress(BrokenPipeError):  # there is nobody behind the gate: the wall was never built
            os.write(opener, b"go\n")
        os.close(opener)
        self._guard = (
            disk_guard.Guard(list(box.writable), limits.disk_bytes, limits.files, self.end) if box.writable else None
        )

    def __enter__(self) -> Process:
        """Return the running process."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """End the whole tree."""
        self.kill()

    @property
    def wall_seconds(self) -> float:
        """Return the wall time since the start, in seconds."""
        return time.monotonic() - self.started

    @property
    def output(self) -> str:
        """Return what the process has printed so far (stdout and stderr together, the middle cut if too long)."""
        return self._output.text()

    def exit_code(self) -> int | None:
        """Return the exit status, negative for a signal, or None while the process runs."""
        code = self._popen.poll()
        # bwrap reports a child that died of signal N as 128 + N.
        return None if code is None else (128 - code if code > 128 else code)

    def wait(self, seconds: float) -> int | None:
        """Return the exit status once the process has ended, or None if it still runs after `seconds`."""
        try:
            self._popen.wait(seconds)
        except subprocess.TimeoutExpired:
            return None
        return self.exit_code()

    def wait_for_work(self, seconds: float) -> int | None:
        """Wait likewise, but count no time in which others had the cores that this command wanted.

        A busy machine so changes no outcome. No more than four times as long in all, whatever the machine does.
        """
        clock = WorkClock(self)
        while (counted := clock.look()) < seconds and self.wall_seconds < _LONGEST * seconds:
            if (code := self.wait(min(_LOOKS_EVERY_S, seconds - counted))) is not None:
                return code
        return None

    def stopped(self) -> str:
        """Return the limit of the whole wall that the command has met: "memory", "processes", "disk" or ""."""
        return self._stopped or (self._guard.met if self._guard else "") or self._group.events()

    _stopped = ""

    def interrupt(self) -> None:
        """Send SIGINT, as Ctrl-C does, to the command itself (and to nobody else in the wall)."""
        for pid in procfs.children(self._init_pid):
            _signal(pid, signal.SIGINT)

    def thread_times(self) -> dict[int, tuple[float, float]]:
        """Return for each thread of the whole tree the seconds that it has run, and has waited for a core."""
        return procfs.thread_times(procfs.descendants(self._init_pid))

    def pin_to(self, cores: Iterable[int]) -> None:
        """Let the whole tree run on these cores only."""
        procfs.pin_to(cores, procfs.descendants(self._init_pid))

    def kill(self) -> None:
        """End the whole tree and wait until it is gone.

        Raises:
            GraderError: the host's disk or memory ran out, so that what the command did says nothing about it.
        """
        self.end()
        if self._guard is not None:
            self._guard.close()
        self._output.close()
        self._stopped = self.stopped()
        self._group.close()
        if self._guard is not None and self._guard.host_is_full:
            raise GraderError(self._guard.host_is_full)
        if self._stopped == cgroup.HOST_MEMORY:
            raise GraderError(shortage.NO_MEMORY)

    def end(self) -> None:
        """End the whole tree; what it printed is still being read."""
        if self._popen.poll() is None:
            # The first process in the pid namespace takes every other one along.
            _signal(self._init_pid or self._popen.pid, signal.SIGKILL)
            try:
                self._popen.wait(5.0)
            except subprocess.TimeoutExpired:
                self._popen.kill()
                self._popen.wait()


class _Output:
    """Reads a process's output as it comes, so that it never blocks, and keeps its head and its tail."""

    def __init__(self, popen: subprocess.Popen[bytes], limit: int) -> None:
        assert popen.stdout is not None
        self._stream = popen.stdout
        self._half = limit // 2
        self._head = b""
        self._tail = b""
        self._dropped = 0
        self._lock = threading.Lock()
        self._thread = threading.Thread(target=self._read, daemon=True)
        self._thread.start()

    def _read(self) -> None:
        descriptor = self._stream.fileno()
        while chunk := os.read(descriptor, 65536):
            with self._lock:
                room = self._half - len(self._head)
                self._head += chunk[:room]
                self._tail += chunk[max(0, room) :]
                self._dropped += max(0, len(self._tail) - self._half)
                self._tail = self._tail[-self._half :]

    def text(self) -> str:
        with self._lock:
            gap = f"\n[... {self._dropped} bytes left out ...]\n".encode() if self._dropped else b""
            return (self._head + gap + self._tail).decode("utf-8", "replace")

    def close(self) -> None:
        # Everything that could hold the pipe's other end is dead by now, so the reader meets the end of the stream.
        self._thread.join(5.0)
        if not self._thread.is_alive():
            self._stream.close()


def run(command: Sequence[str], box: Sandbox, limits: Limits | None = None) -> RunResult:
    """Run `command` walled in, wait for its end or its time limit, and return how it went.

    Raises:
        GraderError: the wall cannot be built on this host.
    """
    limits = limits or Limits()
    with Process(command, box, limits) as process:
        exit_code = process.wait_for_work(limits.wall_seconds)
        seconds = process.wall_seconds
    output = process.output
    if exit_code is not None and output.startswith("bwrap: "):
        raise GraderError(
            f"The wall could not be built: {output.strip()[:500]}. Run `grader doctor`; it says how to mend it. "
            "To grade with hardly any box, which no grade should rest on, say --unsafe-no-sandbox."
        )
    stopped = process.stopped()
    return RunResult(exit_code, output, timed_out=exit_code is None, wall_seconds=seconds, stopped=stopped)


def require() -> None:
    """Check that walls can be built here at all.

    Raises:
        GraderError: they cannot; the message says what to do.
    """
    if not sys.platform.startswith("linux"):
        raise GraderError("Grading needs Linux: submissions are walled in with bubblewrap. Use Linux or WSL 2.")
    if shutil.which("bwrap") is None:
        raise GraderError(
            "bubblewrap (bwrap) is not installed, so a submission cannot be walled in. Run `grader doctor`."
        )
    tried = run(["true"], Sandbox())
    if not tried.ok:
        raise GraderError(
            f"Nothing can be run behind a wall here: {tried.output.strip()[:300]}. Run `grader doctor`; where a limit "
            "cannot be set, somebody has set a lower one for the grader: `ulimit -a` shows it."
        )


def _child_pid(read_end: int) -> int:
    """Return the pid (as seen from here) of the first process in the wall, 0 if the wall was never built."""
    with os.fdopen(read_end, "rb") as stream:
        text = stream.read()
    return int(json.loads(text)["child-pid"]) if text else 0


def _signal(pid: int, number: signal.Signals) -> None:
    with contextlib.suppress(ProcessLookupError):
        os.kill(pid, number)
