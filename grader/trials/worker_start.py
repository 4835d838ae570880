"""Start the processes that run trials, by forking one that has imported everything: that saves 0.5 s of CPU time each.

`Workers` is the side of the grader. `serve_forks` runs in the process that forks, and returns in each fork, which then
runs worker.py.
"""

from __future__ import annotations

import contextlib
import os
import select
import signal
import socket
import subprocess
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import IO, Protocol

from grader.errors import GraderError
from grader.host import namespaces, shortage
from grader.sandbox import warm_python
from grader.trials.request import ALONE, READY, SERVE
from grader.words import say

_WORKER = (sys.executable, "-m", "grader.trials.worker")
_LOG_CHARACTERS = 2000


class Worker(Protocol):
    """A process that reads a request per line and writes an answer per line, such as a subprocess.Popen."""

    stdin: IO[str] | None
    stdout: IO[str] | None

    @property
    def returncode(self) -> int | None:
        """The exit status, negative for a signal; None until `wait` has returned."""

    def wait(self, timeout: float | None = None) -> int:
        """Wait for its end and return the exit status; raise subprocess.TimeoutExpired after `timeout` seconds."""

    def kill(self) -> None:
        """Send SIGKILL."""


class ForkedWorker:
    """A forked worker. Its parent process writes its pid to the pipe `status`, and later its exit status."""

    def __init__(self, stdin: int, stdout: int, status: int) -> None:
        self.stdin: IO[str] | None = os.fdopen(stdin, "w")
        self.stdout: IO[str] | None = os.fdopen(stdout)
        self.returncode: int | None = None
        self._status = os.fdopen(status)
        self.pid = int(self._status.readline() or 0)
        """Its process id, 0 if it has not been forked."""

    def wait(self, timeout: float | None = None) -> int:
        """Wait for its end and return the exit status."""
        if self.returncode is None:
            if not select.select([self._status], [], [], timeout)[0]:
                raise subprocess.TimeoutExpired("worker", timeout or 0.0)
            # Nothing is written if the parent was killed, and the worker with it.
            self.returncode = int(self._status.readline() or -signal.SIGKILL)
            self._status.close()
        return self.returncode

    def kill(self) -> None:
        """Send SIGKILL, unless `wait` has seen its end."""
        if self.returncode is None and self.pid:
            with contextlib.suppress(ProcessLookupError):
                os.kill(self.pid, signal.SIGKILL)


class Workers:
    """Starts workers, each in a network namespace of its own. Call `close` at the end (contextlib.closing).

    Args:
        course: the folder of the course whose trials the workers run.
        environment: the workers' environment.
        folder: the workers' working directory, for their logs, too.
        channels: file descriptors that the workers inherit; their command line names them.
    """

    def __init__(
        self, course: Path, environment: Mapping[str, str], folder: Path, channels: Iterable[int] = ()
    ) -> None:
        self._worker = (*_WORKER, str(course))
        self._environment, self._folder, self._channels = dict(environment), folder, tuple(channels)
        self._forks = True
        self._log = folder / "workers.log"
        self._socket, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with theirs, self._log.open("w") as log:
            self._popen = self._run([*self._worker, SERVE], stdin=theirs.fileno(), stdout=subprocess.DEVNULL, log=log)

    def close(self) -> None:
        """Kill the process that forks workers; workers that still run die with it."""
        self._socket.close()
        self._popen.kill()
        self._popen.wait()

    def start(self, name: str) -> Worker:
        """Start a worker and return it when it is ready.

        Raises:
            GraderError: it does not start.
        """
        log_path = self._folder / f"worker-{name}.log"
        with log_path.open("w") as log:
            if self._forks:
                worker = self._fork(log)
                if _is_ready(worker):
                    return worker
                self._forks = False  # here only bubblewrap may make namespaces, or no worker can start at all
            command = namespaces.private_network([*self._worker, ALONE])
            started = self._run(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, log=log)
            if _is_ready(started):
                return started
        said = "\n".join(path.read_text().strip()[-_LOG_CHARACTERS:] for path in (self._log, log_path)).strip()
        raise GraderError(
            shortage.explain_output(said)
            or shortage.explain_disk(self._folder)
            or say("The trial worker did not start:\n{said}\nRun `grader doctor`.", said=said)
        )

    def _run(self, command: list[str], *, stdin: int, stdout: int, log: IO[str]) -> subprocess.Popen[str]:
        return subprocess.Popen(
            [*command, *map(str, self._channels)],
            pass_fds=self._channels,
            stdin=stdin,
            stdout=stdout,
            stderr=log,
            env=self._environment,
            cwd=self._folder,
            text=True,
        )

    def _fork(self, log: IO[str]) -> ForkedWorker:
        (stdin, requests), (answers, stdout), (ended, status) = os.pipe(), os.pipe(), os.pipe()
        theirs = (stdin, stdout, log.fileno(), status)
        with contextlib.suppress(OSError):  # the process that forks has ended: no pid will arrive
            socket.send_fds(self._socket, [b"fork"], theirs)
        for descriptor in (stdin, stdout, status):
            os.close(descriptor)
        return ForkedWorker(requests, answers, ended)


def _is_ready(worker: Worker) -> bool:
    """Wait until a worker is ready and return True; if it does not start, end it and return False."""
    assert worker.stdin is not None
    assert worker.stdout is not None
    if worker.stdout.readline().strip() == READY:
        return True
    worker.kill()
    worker.wait()
    worker.stdin.close()
    worker.stdout.close()
    return False


def serve_forks() -> None:
    """Fork a worker for each request until the grader closes the socket. Returns in the workers only.

    A request carries four file descriptors: the worker's standard input, output and error, and a pipe to which the
    worker's parent writes its pid and, at the end, its exit status.
    """
    serving = os.getpid()
    with socket.socket(fileno=os.dup(0)) as channel:
        signal.signal(signal.SIGCHLD, signal.SIG_IGN)  # the kernel forgets those that have ended
        while True:
            data, descriptors, _, _ = socket.recv_fds(channel, 16, 4)
            if not data:
                sys.exit()
            if warm_python.fork() == 0:
                break
            for descriptor in descriptors:
                os.close(descriptor)
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)
    warm_python.die_with(serving)
    *streams, status = descriptors
    waiting = os.getpid()
    if (pid := os.fork()) != 0:
        for number in (0, *streams):  # otherwise the grader would not see the worker close them
            os.close(number)
        warm_python.tell(status, str(pid))
        _, ended = os.waitpid(pid, 0)
        warm_python.tell(status, str(os.waitstatus_to_exitcode(ended)))
        os._exit(0)
    warm_python.die_with(waiting)
    for number, stream in enumerate(streams):
        os.dup2(stream, number)
    for descriptor in descriptors:
        os.close(descriptor)
