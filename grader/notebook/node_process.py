"""Build the student's package, and run one of its nodes as a process that ends with the notebook's kernel."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path

from grader import KIT, building
from grader.errors import SubmissionError
from grader.notebook import prerequisites
from grader.notebook.workspace import NOTEBOOK, Workspace, course
from grader.words import mark, say

_KILL_AFTER_S = 3.0
_OUTPUT_CAP = 200_000


def install(workspace: Workspace, node: str, far: Callable[[str], object] = lambda _far: None) -> Path:
    """Build the package if it has changed, and return its install tree, which holds the node.

    `far` is called about once a second with how far the build is.

    Raises:
        SubmissionError: the package lacks something, does not build, or does not install the node.
        GraderError: this host cannot build.
    """
    modules = [course().nodes[node].module] if node in course().nodes else []
    gap = prerequisites.first_missing(workspace.package, (*course().builds, *modules), os.environ.get(NOTEBOOK, ""))
    if gap is not None:
        raise SubmissionError(f"{gap.seen}; {gap.try_}")
    if workspace.is_linked:
        return workspace.install
    built = building.build([workspace.package], building.cache_folder(), course(), far=far)
    if not built.facts.ok:
        words = mark("the package does not build: {first_error}")
        raise SubmissionError(say(words, first_error=prerequisites.first_error(built.facts)))
    if node not in built.facts.executables:
        words = mark("the package installs no executable {node} in lib/{package}")
        raise SubmissionError(say(words, node=node, package=course().package))
    return built.install


def command(installed: Path, node: str, program: str, launch: str, parameters: Mapping[str, object]) -> list[str]:
    """Return the command line of a node, as `ros2 run` would start it, of a Python file, or of a launch file."""
    if launch:
        ros2 = str(KIT / "grader" / "ros2")
        return [sys.executable, ros2, "launch", course().package, *launch.split(), "use_sim_time:=true"]
    start = [sys.executable, str(Path(program).resolve())] if program else [installed / "lib" / course().package / node]
    values = {"use_sim_time": True, **parameters}
    given = [f"{name}:={str(value).lower() if isinstance(value, bool) else value}" for name, value in values.items()]
    return [*map(str, start), "--ros-args", *(word for each in given for word in ("-p", each))]


class NodeProcess:
    """A node in a process group of its own, with the methods that a trial's stage expects of a program."""

    def __init__(self, command: list[str], environment: Mapping[str, str]) -> None:
        self.started = time.monotonic()
        self._text = bytearray()
        self._popen = _STARTER.submit(_start, command, dict(environment)).result()
        self._gone = False
        self._reader = threading.Thread(target=_read, args=(self._popen, self._text), daemon=True)
        self._reader.start()

    @property
    def wall_seconds(self) -> float:
        """Return the seconds since it was started."""
        return time.monotonic() - self.started

    @property
    def output(self) -> str:
        """Return its output so far, on both streams."""
        return bytes(self._text).decode("utf-8", "replace")

    def exit_code(self) -> int | None:
        """Return its exit code, None while it runs."""
        return self._popen.poll()

    def has_ended(self) -> bool:
        """Return whether it has ended."""
        return self.exit_code() is not None

    def interrupt(self) -> None:
        """Send SIGINT, as Ctrl-C does."""
        self._popen.send_signal(signal.SIGINT)

    def abort(self) -> None:
        """Send SIGABRT, on which Python's faulthandler writes down what each thread was doing."""
        self._popen.send_signal(signal.SIGABRT)

    def thread_times(self) -> dict[int, tuple[float, float]]:
        """Return nothing: a notebook shows the wall time of a node's end."""
        return {}

    def cpu_seconds(self) -> float:
        """Return nothing, for the same reason."""
        return 0.0

    def stopped(self) -> str:
        """Return nothing: the student's own machine sets no limits."""
        return ""

    def kill(self) -> None:
        """Kill the whole group and wait for its end."""
        if self._gone:
            return  # its process group's number may belong to another by now
        self._gone = True
        with suppress(ProcessLookupError, PermissionError):
            os.killpg(self._popen.pid, signal.SIGKILL)
        with suppress(subprocess.TimeoutExpired):
            self._popen.wait(_KILL_AFTER_S)
        self._reader.join(_KILL_AFTER_S)


def _start(command: list[str], environment: dict[str, str]) -> subprocess.Popen[bytes]:
    return subprocess.Popen(
        [sys.executable, "-P", "-c", _GUARD, str(os.getpid()), *command],
        stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, env=environment,
        start_new_session=True,
    )  # fmt: skip


# A thread that lasts as long as this process: Linux sends the signal below when the *thread* that started the node
# ends, and a node may be started from a live view's thread.
_STARTER = ThreadPoolExecutor(1, thread_name_prefix="starter")

# Sets PR_SET_PDEATHSIG between fork and exec: the node then dies with the notebook's kernel, however that ends.
_GUARD = """
import ctypes, os, signal, sys
ctypes.CDLL(None).prctl(1, signal.SIGKILL)
if os.getppid() != int(sys.argv[1]): sys.exit(1)
os.execv(sys.argv[2], sys.argv[2:])
"""


def _read(popen: subprocess.Popen[bytes], text: bytearray) -> None:
    assert popen.stdout is not None
    with popen.stdout as stream:
        while chunk := os.read(stream.fileno(), 65536):
            if len(text) < _OUTPUT_CAP:
                text += chunk
