"""Carry out work in a child process, so that Ctrl-C ends it at once and leaves nothing of it.

A grading waits in several threads for builds, tests and trials, and a thread cannot be interrupted; a process can.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import signal
import subprocess
import sys
import tempfile
import time
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import NoReturn

from grader import KIT
from grader.errors import GraderError
from grader.host import cgroup, procfs, shortage, tempdir
from grader.words import say

STEP = "step "
"""How a line begins in which a program that was started says what goes on."""
_PR_SET_PDEATHSIG, _PR_SET_CHILD_SUBREAPER = 1, 36
_GRACE_S = 1.0  # for the moment in which results are moved to their place (atomic.replace_entries)
_LIMIT_S = 10.0  # killed processes are gone at once, unless the kernel holds them


def run(work: Callable[[], int], parent: int = 0) -> int:
    """Return the exit status of `work`, which is carried out in a child process with temporary files of its own.

    For the main program, while it has no other threads. With `parent`, the pid of the process that has started it, the
    end of the thread by which it was started counts as SIGTERM.

    Raises:
        KeyboardInterrupt: Ctrl-C or SIGTERM. No process and no temporary file of the work is left; further signals of
            these kinds are held back.
        GraderError: the child was killed from outside. Nothing of it is left either.
    """
    # Orphans of the child become this process's children, so that all of them can be found and waited for.
    ctypes.CDLL(None).prctl(_PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)
    if parent:
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)
        if os.getppid() != parent:  # it has ended before
            raise KeyboardInterrupt
    # A shell lets programs that it starts in the background ignore Ctrl-C.
    ending = {number for number in (signal.SIGINT, signal.SIGTERM) if signal.getsignal(number) != signal.SIG_IGN}
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {*ending, signal.SIGCHLD})
    with tempdir.folder("grader") as temporary:
        sys.stdout.flush()
        sys.stderr.flush()
        supervisor, child = os.getpid(), os.fork()
        if child == 0:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
            _be_child(work, supervisor, temporary)
        status, interrupted = _wait(child, ending)
        if status >= 0:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
            return status
        _kill_descendants()
    if interrupted:
        raise KeyboardInterrupt
    raise GraderError(say(shortage.KILLED))


def start(module: str, *arguments: str) -> subprocess.Popen[str]:
    """Start a module of the kit that is in `run`, in a session of its own, so that Ctrl-C does not reach it."""
    # Without empty parts, each of which would mean the current folder.
    path = [str(KIT), *filter(None, os.environ.get("PYTHONPATH", "").split(os.pathsep))]
    return subprocess.Popen(
        [sys.executable, "-P", "-m", module, *arguments],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, start_new_session=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(path)},
    )  # fmt: skip


def hear(program: subprocess.Popen[str], progress: Callable[[str], None], task: str = "") -> list[str]:
    """Give a program that was started its task, pass its steps on, and return what else it has said, line by line.

    It has ended then, also if this is interrupted.
    """
    said = []
    try:
        assert program.stdin is not None
        assert program.stdout is not None
        with contextlib.suppress(BrokenPipeError), program.stdin:  # it has ended; what it said tells why
            program.stdin.write(task)
        for line in program.stdout:
            if line.startswith(STEP):
                progress(line.removeprefix(STEP).rstrip("\n"))
            else:
                said.append(line.rstrip("\n"))
        program.wait()
    finally:
        end(program)
    return said


def end(program: subprocess.Popen[str]) -> None:
    """End a program that is in `run`, and all that it has started, and wait until they are gone."""
    while program.poll() is None:
        with contextlib.suppress(KeyboardInterrupt):  # pressed again: there is nothing quicker
            program.terminate()
            program.wait()
    for stream in (program.stdin, program.stdout):
        if stream is not None:
            with contextlib.suppress(OSError):
                stream.close()


def read_task() -> str:
    """Return what is on standard input, and leave nothing of it to the programs that this process starts."""
    task = sys.stdin.read()
    null = os.open(os.devnull, os.O_RDONLY)
    os.dup2(null, sys.stdin.fileno())
    os.close(null)
    return task


def _be_child(work: Callable[[], int], supervisor: int, temporary: Path) -> NoReturn:
    status = 1
    try:
        os.setsid()  # Ctrl-C reaches the parent alone
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() != supervisor:  # it died between the fork and here
            os._exit(1)
        os.environ["TMPDIR"] = tempfile.tempdir = str(temporary)
        status = work()
    except BaseException:
        traceback.print_exc()
    finally:
        with contextlib.suppress(OSError):  # nobody reads it any more
            sys.stdout.flush()
            sys.stderr.flush()
        os._exit(status)


def _wait(child: int, ending: set[signal.Signals]) -> tuple[int, bool]:
    """Return the child's exit status, negative if it was killed, and whether an `ending` signal came."""
    interrupted, deadline = False, float("inf")
    while True:
        for ended, status in _reaped():
            if ended == child:
                return os.waitstatus_to_exitcode(status), interrupted
        if time.monotonic() > deadline:
            return -signal.SIGKILL, interrupted
        got = signal.sigtimedwait({*ending, signal.SIGCHLD}, _GRACE_S)
        if got is not None and got.si_signo in ending and not interrupted:
            interrupted, deadline = True, time.monotonic() + _GRACE_S
            os.kill(child, signal.SIGTERM)


def _reaped() -> list[tuple[int, int]]:
    """Return the ids and the statuses of those of our children that have ended."""
    found = []
    with contextlib.suppress(ChildProcessError):
        while (ended := os.waitpid(-1, os.WNOHANG))[0]:
            found.append(ended)
    return found


def _kill_descendants() -> None:
    """Kill all processes below this one, and wait until they are gone."""
    deadline = time.monotonic() + _LIMIT_S
    while (left := procfs.descendants(os.getpid())) and time.monotonic() < deadline:
        procfs.kill(left)
        _reaped()
    cgroup.sweep()
