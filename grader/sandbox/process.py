"""Run one command in a sandbox. Once it has been stopped, its whole process tree is gone before its files are read."""

from __future__ import annotations

import contextlib
import ctypes
import json
import os
import select
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from types import TracebackType
from typing import IO

from grader.errors import GraderError
from grader.host import cgroup, namespaces, procfs, shortage, submission_user
from grader.host.machine import Machine
from grader.sandbox import users
from grader.sandbox.bwrap import WAIT_FOR_GO, Limits, Sandbox, bwrap_command, enter_cgroup, with_limits
from grader.sandbox.cpu_clock import CpuClock
from grader.sandbox.guards import DiskGuard, ProcessGuard
from grader.sandbox.syscall_filter import open_filter
from grader.words import mark, say

_CLOCK_PERIOD_S = 1.0  # between two readings of how long a command has waited for a CPU
_LAST_OUTPUT_S = 5.0  # for our own thread to read what has been written
_GONE_S = 60.0  # for the kernel to end what is killed, which it does at once unless a disk holds a process up
_HELD = mark(
    "A process of the submission has not ended within {seconds:g} s after it was killed: the kernel holds it, as for a "
    "network disk that does not answer. `ps -eo pid,stat,wchan:20,args` shows it. End what it waits for, then grade "
    "again."
)
_KEYCTL, _JOIN_SESSION_KEYRING = 250, 1  # <asm/unistd_64.h>, <linux/keyctl.h>
_MAX_STRETCH = 4  # wall time that a command may take on a busy machine, in multiples of its time limit


@dataclass(frozen=True)
class RunResult:
    """How a command ended. `exit_code` is negative for a signal, None if it exceeded its time limit.

    `stopped` names the limit of the whole sandbox that it exceeded: "memory", "processes", "disk" or "".
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
    """A running command in a sandbox. A context manager: leaving it kills the whole process tree."""

    def __init__(self, command: Sequence[str], box: Sandbox, limits: Limits) -> None:
        """Start `command` in a sandbox of its own."""
        self.started = time.monotonic()
        self._stopped = ""
        self._written = list(box.writable)
        self._user = None if box.trusted else submission_user.choose()
        if self._user is not None:
            _require_readable(box)
            submission_user.give(self._written, self._user)
        self._group = cgroup.create(limits.resident_bytes, limits.processes)
        self._init_end: int | None = None
        self._guards: list[DiskGuard | ProcessGuard] = []
        inside = (*WAIT_FOR_GO, *with_limits(command, limits))
        self._view = users.lay_out(box, self._user) if namespaces.refusal() else None
        read_end, info_fd = os.pipe()
        with os.fdopen(read_end, "rb") as info:
            filter_fd = open_filter()
            if self._view is None:
                command_line = [*bwrap_command(box, info_fd, filter_fd, self._user), *inside]
            else:
                command_line = users.command_line(
                    inside, box, self._view, user=self._user, info_fd=info_fd,
                    locked=not namespaces.sandbox_disabled(),
                )  # fmt: skip
            # This thread, and so what it starts, gets an empty session keyring; a kernel without any refuses.
            ctypes.CDLL(None).syscall(_KEYCTL, _JOIN_SESSION_KEYRING, None)
            try:
                self._popen = subprocess.Popen(
                    [*enter_cgroup(self._group), *command_line], start_new_session=True,
                    stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, bufsize=0,
                    pass_fds=(info_fd, filter_fd), env={"PATH": os.environ.get("PATH", "/usr/bin:/bin")},
                )  # fmt: skip
            except OSError as error:
                self._group.close()
                if self._view is not None:
                    self._view.close()
                words = mark("Cannot start {program} ({why}). Run `grader doctor`; it prints the fix.")
                raise GraderError(say(words, program="bwrap", why=error)) from error
            finally:
                os.close(info_fd)
                os.close(filter_fd)
            assert self._popen.stdin is not None
            assert self._popen.stdout is not None
            self._output = _Output(self._popen.stdout, limits.output_bytes)
            text = info.read()
        self._init_pid = int(json.loads(text)["child-pid"]) if text else 0
        """The pid, on the host, of the first process in the sandbox; 0 if the sandbox could not be set up."""
        if self._init_pid:
            with contextlib.suppress(ProcessLookupError):  # it has ended
                self._init_end = os.pidfd_open(self._init_pid)
        self.tell("asked" if box.asked else "go")
        if not box.asked:
            self._popen.stdin.close()
        if watched := [*box.writable, *(self._view.own if self._view is not None else ())]:
            self._guards.append(DiskGuard(watched, limits.disk_bytes, limits.files, self._kill_tree))
        if self._init_pid and not self._group.folders:
            self._guards.append(ProcessGuard(self.pids, limits.processes, self._kill_tree))

    def __enter__(self) -> Process:
        """Return the running process."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Kill the whole process tree."""
        self.kill()

    def tell(self, line: str) -> None:
        """Write a line to the command's standard input, which a sandbox has to be `asked` for."""
        assert self._popen.stdin is not None
        with contextlib.suppress(BrokenPipeError):  # it has ended, or could not be set up
            self._popen.stdin.write(f"{line}\n".encode())

    @property
    def wall_seconds(self) -> float:
        """Return the wall time since the start, in seconds."""
        return time.monotonic() - self.started

    @property
    def output(self) -> str:
        """Return the output so far, stdout and stderr together, with the middle cut out if it is too long.

        It is whole once the exit status is known.
        """
        if self._popen.poll() is not None:
            self._output.wait()
        return self._output.text()

    def forget_output(self) -> None:
        """Forget what it has written so far."""
        self._output.forget()

    def exit_code(self) -> int | None:
        """Return the exit status, negative for a signal, or None while the process runs."""
        code = self._popen.poll()
        # bwrap reports a child that died of signal N as 128 + N.
        return None if code is None else (128 - code if code > 128 else code)

    def has_ended(self) -> bool:
        """Return whether the command has ended, whose exit status is known once other processes have run, too."""
        return not any(map(procfs.runs, self._command()))

    def wait(self, seconds: float) -> int | None:
        """Return the exit status once the whole tree has ended, or None if it still runs after `seconds`."""
        try:
            self._popen.wait(seconds)
        except subprocess.TimeoutExpired:
            return None
        self._await_init()
        return self.exit_code()

    def wait_on_cpu_clock(self, seconds: float, heard: Callable[[str], object] | None = None) -> int | None:
        """Wait in the same way, but exclude time spent waiting for a CPU, so that a busy machine changes no outcome.

        Waits at most four times as long in all. `heard` is called about once a second with the output so far.
        """
        clock = CpuClock(self)
        while (counted := clock.read()) < seconds and self.wall_seconds < _MAX_STRETCH * seconds:
            if (code := self.wait(min(_CLOCK_PERIOD_S, seconds - counted))) is not None:
                return code
            if heard is not None:
                heard(self.output)
        return None

    def stopped(self) -> str:
        """Return the limit of the whole sandbox that the command has exceeded: "memory", "processes", "disk" or ""."""
        exceeded = next((guard.exceeded for guard in self._guards if guard.exceeded), "")
        return self._stopped or exceeded or self._group.limit_hit()

    def interrupt(self) -> None:
        """Send SIGINT, as Ctrl-C does, to the command itself and to no other process in the sandbox."""
        self._signal_command(signal.SIGINT)

    def abort(self) -> None:
        """Send SIGABRT to the command itself, on which Python's faulthandler writes down what each thread was doing."""
        self._signal_command(signal.SIGABRT)

    def thread_times(self) -> dict[int, tuple[float, float]]:
        """Return for each thread of the whole tree the seconds that it has run, and has waited for a core."""
        return procfs.thread_times(self.pids())

    def cpu_seconds(self) -> float:
        """Return the CPU time that the whole tree has used, with the processes in it that have ended."""
        return procfs.cpu_seconds([self._init_pid, *self.pids()])

    def kill(self) -> None:
        """Kill the whole process tree and wait until it is gone.

        Raises:
            GraderError: the host ran out of disk space or memory, so the result says nothing about the command.
        """
        self._kill_tree()
        gone = self._await_init()
        for guard in self._guards:
            guard.close()
        if self._init_end is not None:  # not before: a guard may be killing the tree
            os.close(self._init_end)
            self._init_end = None
        if self._popen.stdin is not None:
            self._popen.stdin.close()
        self._output.close()
        if self._view is not None:
            self._view.close()
            self._view = None
        if self._user is not None:
            submission_user.give(self._written, os.geteuid())
        self._stopped = self.stopped()
        self._group.close()
        if not gone:
            raise GraderError(say(_HELD, seconds=_GONE_S))
        for guard in self._guards:
            if isinstance(guard, DiskGuard) and guard.host_full:
                raise GraderError(guard.host_full)
        if self._stopped == cgroup.HOST_MEMORY:
            raise GraderError(say(shortage.NO_MEMORY))

    def _signal_command(self, number: signal.Signals) -> None:
        for pid in self._command():
            procfs.send(pid, number)

    def _command(self) -> list[int]:
        return procfs.children(self._init_pid)

    def pids(self) -> list[int]:
        """Return the pids of all processes below the sandbox's first one.

        With those of proot, for which a command waits at each kernel call.
        """
        return procfs.descendants_at_a_glance(self._init_pid if self._view is None else self._popen.pid)

    def _kill_tree(self) -> None:
        """Kill the whole process tree; its output can still be read."""
        if self._popen.poll() is None:
            if self._view is None:
                # When the first process of a pid namespace dies, the kernel kills all others in it.
                procfs.send(self._init_pid or self._popen.pid, signal.SIGKILL)
            else:
                self._popen.terminate()
            try:
                self._popen.wait(5.0)
            except subprocess.TimeoutExpired:
                self._popen.kill()
                self._popen.wait()
        self._await_init()

    def _await_init(self) -> bool:
        """Wait until the first process of the sandbox has ended, and with it all others in its pid namespace.

        Return whether it has. bubblewrap has ended before it: it goes as soon as it knows the command's exit status,
        and the kernel kills the first process after that.
        """
        if self._init_end is None:
            return True
        waiting = select.poll()  # unlike select(), with any number of open files
        waiting.register(self._init_end, select.POLLIN)
        return bool(waiting.poll(_GONE_S * 1000))


class _Output:
    """Reads a process's output as it arrives, so that the process never blocks, and keeps the start and the end."""

    def __init__(self, stream: IO[bytes], limit: int) -> None:
        self._stream = stream
        self._half = limit // 2
        self._head = b""
        self._tail = b""
        self._dropped = 0
        self._lock = threading.Lock()
        self._thread = threading.Thread(target=self._read, daemon=True)
        self._thread.start()

    def _read(self) -> None:
        while chunk := self._stream.read(65536):
            with self._lock:
                space = self._half - len(self._head)
                self._head += chunk[:space]
                self._tail += chunk[max(0, space) :]
                self._dropped += max(0, len(self._tail) - self._half)
                self._tail = self._tail[-self._half :]

    def forget(self) -> None:
        with self._lock:
            self._head, self._tail, self._dropped = b"", b"", 0

    def text(self) -> str:
        with self._lock:
            gap = f"\n[... {self._dropped} bytes left out ...]\n".encode() if self._dropped else b""
            return (self._head + gap + self._tail).decode("utf-8", "replace")

    def wait(self) -> None:
        """Wait for the last of it, when every process that could hold the pipe's other end is dead."""
        self._thread.join(_LAST_OUTPUT_S)

    def close(self) -> None:
        self.wait()
        if not self._thread.is_alive():
            self._stream.close()


def run(
    command: Sequence[str], box: Sandbox, limits: Limits | None = None, heard: Callable[[str], object] | None = None
) -> RunResult:
    """Run `command` in the sandbox, wait until it ends or exceeds its time limit, and return the result.

    `heard` is called about once a second with the output so far.

    Raises:
        GraderError: this host cannot set up a sandbox.
    """
    limits = limits or Limits()
    with Process(command, box, limits) as process:
        exit_code = process.wait_on_cpu_clock(limits.wall_seconds, heard)
        seconds = process.wall_seconds
    output = process.output
    if exit_code is not None and output.startswith(("bwrap: ", "proot error: ", "seccomp: ")):
        raise GraderError(
            say(
                "The sandbox could not be set up: {why}. Run `grader doctor`; it prints the fix. "
                "--unsafe-no-sandbox grades almost without a sandbox, which is not enough for a real grade.",
                why=output.strip()[:500],
            )
        )
    stopped = process.stopped()
    return RunResult(exit_code, output, timed_out=exit_code is None, wall_seconds=seconds, stopped=stopped)


def require(*, for_points: bool = True) -> None:
    """Check that this host can set up a sandbox, and one that is good enough if points are to be given.

    Raises:
        GraderError: it cannot; the message says what to do.
    """
    if not sys.platform.startswith("linux"):
        raise GraderError(say("Grading needs Linux: submissions run in bubblewrap. Use Linux or WSL 2."))
    if (most := Machine().process_limit()) < shortage.FEW_PROCESSES:
        words = mark("A grading has more processes than the {most} of this container. Run `grader doctor`.")
        raise GraderError(say(words, most=most))
    if why := namespaces.refusal():
        if for_points and namespaces.confinement() is namespaces.Confinement.NONE and not namespaces.sandbox_disabled():
            raise GraderError(
                say(
                    "No sandbox that keeps a submission apart works here ({why}), so no points are given. "
                    "`grader check` works for your own package. Run `grader doctor`; it prints the fix.",
                    why=why,
                )
            )
        if lacks := submission_user.lacks():
            words = mark("No sandbox works here: {why}, and {lacks}. Run `grader doctor`; it prints the fix.")
            raise GraderError(say(words, why=why, lacks=lacks))
    tried = run(["true"], Sandbox())
    if not tried.ok:
        raise GraderError(
            say(
                "No command can run in a sandbox here: {why}. Run `grader doctor`. If a limit cannot be set, the "
                "grader itself has a lower one: `ulimit -a` shows it.",
                why=tried.output.strip()[:300],
            )
        )


def _require_readable(box: Sandbox) -> None:
    """Check that the sandbox's own user can read what it is given.

    Raises:
        GraderError: it cannot, and the submission would be charged with it.
    """
    for path in box.read_only:
        if path.exists() and not submission_user.is_readable(path):
            raise GraderError(
                say(
                    "{path} can be read by root alone, and submissions do not run as root. "
                    "Run `chmod -R go+rX {path}`, or grade as an ordinary user.",
                    path=path,
                )
            )
