"""Starts the nodes of a worker's trials in one sandbox, by forks of a process that has imported rclpy.

This is the host's side of `fork_nodes`. To start Python and to import what every node imports takes a quarter of a
second of CPU time, more than half of what a trial needs to start its node. After each trial everything in the sandbox
but its first process is killed, and its disks are emptied. All nodes are the same submission's.
"""

from __future__ import annotations

import json
import re
import secrets
import signal
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from grader import building, sandbox
from grader.errors import GraderError
from grader.host import namespaces, procfs, ros_env
from grader.sandbox import untrusted
from grader.sandbox.first_process import MODULES
from grader.trials.what_ran import Notes
from grader.words import say

_SCRIPT = "/ws/first/fork_nodes.py"
COMMAND = ("python3", _SCRIPT)
_PYTHON = re.compile(rb"#!\s*(/usr/bin/env\s+)?\S*python(3(\.\d+)?)?\s*\n")
_PROGRAM_BYTES = 1_000_000
_ANSWER_S = 60.0  # by the clock, on a very busy machine
_POLL_S = 0.002


def node_environment() -> dict[str, str]:
    """Return the environment of nodes but for their DDS domain: that of the ROS which has been chosen by now."""
    found = ros_env.environment(building.INSTALL, home=sandbox.HOME)
    # With faulthandler a node that hangs can tell where.
    return found | {"PYTHONFAULTHANDLER": "1", "PYTHONPATH": f"{sandbox.AT_START}:{found['PYTHONPATH']}"}


def can_fork(install: Path, program: Path) -> bool:
    """Return whether a fork of a process that has imported rclpy is what Python would make of a program.

    It is if the program is a Python script, and nothing that is installed, or lies beside the program, would be
    imported in place of what is there by then.
    """
    if namespaces.confinement() is not namespaces.Confinement.NAMESPACES or namespaces.sandbox_disabled():
        return False
    modules = {*sys.stdlib_module_names, *(name.partition(".")[0] for name in (*MODULES, "usercustomize"))}
    beside = (path for path in program.parent.glob("*") if path.suffix or path.is_dir())
    installed = {path.name.partition(".")[0] for path in (*(install / ros_env.SITE_IN_PREFIX).glob("*"), *beside)}
    text = untrusted.read_bytes(program, _PROGRAM_BYTES)
    return text is not None and bool(_PYTHON.match(text)) and installed.isdisjoint(modules)


class NodeServer:
    """A sandbox in which nodes of an install tree are forked, one after another. Call `close` at the end.

    Args:
        install: the submission's install tree.
        folder: for what its processes note of what runs.
    """

    def __init__(self, install: Path, folder: Path, limits: sandbox.Limits) -> None:
        self.notes = Notes(folder)
        environment = node_environment()
        own = ros_env.environment(home=sandbox.HOME)["PYTHONPATH"]  # nothing that is installed
        environment["PYTHONPATH"] = f"{sandbox.AT_START}:{own}".removesuffix(":")
        box = sandbox.Sandbox(
            read_only={
                install: str(building.INSTALL), Path(__file__).with_name("fork_nodes.py"): _SCRIPT,
                **sandbox.beside_script(str(Path(_SCRIPT).parent)), **self.notes.mounts,
            },
            environment=environment, network=True, pipes=(self.notes.pipe,), as_init=True, asked=True,
        )  # fmt: skip
        self.process = sandbox.Process(COMMAND, box, limits)
        self._words: list[str] = []
        self.works = self.said() is not None
        """Whether it can start nodes: it cannot if what is installed keeps rclpy from being imported."""
        self._forget()

    def start(self, command: Sequence[str], environment: Mapping[str, str]) -> ForkedNode:
        """Start a program; what an earlier one has left is gone.

        Raises:
            GraderError: the sandbox does not work.
        """
        began, before = time.monotonic(), {*self.process.pids()}
        self.process.tell(json.dumps({"command": [*command], "environment": {**environment}}))
        while not (pids := {*self.process.pids()} - before):
            if self.process.exit_code() is not None or time.monotonic() - began > _ANSWER_S:
                raise GraderError(say("The process that starts nodes has ended:\n{said}", said=self.process.output))
            time.sleep(_POLL_S)
        return ForkedNode(self, min(pids), began)

    def said(self, *, clear: bool = False) -> str | None:
        """Return the output so far once all of it has arrived; None if that is not to be known any more.

        With `clear` all other processes are killed before, and the sandbox's disks emptied.
        """
        self._words.append(word := secrets.token_hex(16))
        self.process.tell(json.dumps({"say": word, "clear": clear}))
        deadline = time.monotonic() + _ANSWER_S
        while f"{word}\n" not in (output := self.process.output):
            if self.process.exit_code() is not None or time.monotonic() > deadline:
                return None
            time.sleep(_POLL_S)
        return re.sub(f"({'|'.join(self._words)})\n", "", output)

    def clear(self) -> bool:
        """End what still runs in the sandbox, and delete what it has written; return whether the sandbox can go on."""
        if self.process.stopped() or self.said(clear=True) is None:
            return False
        self._forget()
        return True

    def _forget(self) -> None:
        self.process.forget_output()
        self._words.clear()

    def close(self) -> None:
        """End the sandbox."""
        self.notes.close()
        self.process.kill()


@dataclass(frozen=True)
class ForkedNode:
    """A running program of a NodeServer's: a `Program` of `node_under_test`."""

    server: NodeServer
    pid: int
    began: float

    @property
    def wall_seconds(self) -> float:
        """Return how long ago it was started."""
        return time.monotonic() - self.began

    @property
    def output(self) -> str:
        """Return its output, stdout and stderr together; all of it once it has ended."""
        whole = self.server.said() if self.has_ended() else None
        return self.server.process.output if whole is None else whole

    def exit_code(self) -> int | None:
        """Return its exit code, negative for a signal, None while it runs."""
        if not self.has_ended():
            return None
        code = procfs.exit_code(self.pid)
        return self.server.process.exit_code() if code is None else code  # the sandbox itself has ended

    def has_ended(self) -> bool:
        """Return whether it has ended."""
        return not procfs.runs(self.pid)

    def interrupt(self) -> None:
        """Send it SIGINT, as Ctrl-C does."""
        procfs.send(self.pid, signal.SIGINT)

    def abort(self) -> None:
        """Send it SIGABRT, on which Python's faulthandler writes down what each thread was doing."""
        procfs.send(self.pid, signal.SIGABRT)

    def stopped(self) -> str:
        """Return the limit that the sandbox has exceeded, "" if none."""
        return self.server.process.stopped()

    def thread_times(self) -> dict[int, tuple[float, float]]:
        """Return for each thread of it, and of what it has started, the seconds that it ran and waited for a core."""
        return self.server.process.thread_times()

    def cpu_seconds(self) -> float:
        """Return the CPU time that all processes of the sandbox have used."""
        return self.server.process.cpu_seconds()

    def pids(self) -> list[int]:
        """Return its pid, and those of what it has started."""
        return self.server.process.pids()
