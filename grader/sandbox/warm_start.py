"""Start Python programs in sandboxes without Python's own start: as forks of a process that has imported much.

A node needs 0.2 s of CPU time for the same imports each time: Python's, numpy's, rclpy's. Here it gets them for
nothing. The process that is forked runs no code of a submission, and the fork has the sandbox's namespaces, limits,
user and filter of kernel calls before it runs any. What a program could notice is listed in docs/trials.md.
"""

from __future__ import annotations

import contextlib
import json
import os
import re
import signal
import socket
import subprocess
from collections.abc import Mapping, Sequence
from functools import cache, cached_property
from pathlib import Path
from types import TracebackType
from typing import TextIO

from grader.host import cgroup, namespaces, ros_env
from grader.sandbox import untrusted
from grader.sandbox.bwrap import AT_START, DEFAULT_SIGNALS, Limits, Sandbox, resource_limits
from grader.sandbox.syscall_filter import PROGRAM_BYTES

NAMESPACES = namespaces.Confinement.NAMESPACES
_SCRIPT = Path(__file__).with_name("warm_python.py")
IMPORTS = Path(__file__).with_name("warm_imports.py")
"""A module that imports what nodes need and nothing of the grader, so that it can be mounted alone and run by path."""
_INTERPRETERS = ("/usr/bin/env python3", f"{ros_env.PREFIX}/bin/python3")
_FIRST_LINE = re.compile(rf"#! ?({'|'.join(map(re.escape, _INTERPRETERS))})[ \t]*\n".encode())
_LONGEST_SCRIPT = 100_000
LAUNCH = ("python3", "/ws/ros2", "launch")
"""How the command begins that runs a launch file; it may start nodes as forks, too."""
_FORKS_VARIABLE = "ROS2_COURSE_KIT_FORKS"  # read by grader/ros2/launching/forked.py
_LOADED = b"loaded"
# Python imports these by their names before the program.
_AT_START = frozenset({"sitecustomize", "usercustomize"})
_TYPE_LIBRARY = re.compile(r"lib(\w+)__rosidl_(generator|typesupport(_fastrtps|_introspection)?)_(c|cpp|py)\.so")
_DIFFERS = "ROS_DOMAIN_ID"  # the one variable that may differ from the warm process's; read when a node comes up


class CannotFork(Exception):
    """A program could not be forked into a sandbox. Some kernels and container engines do not allow it."""


class Program:
    """A program that was started in a sandbox by a WarmPython. Its parent process is outside of the sandbox."""

    def __init__(self, status: TextIO) -> None:
        """Wait until the program runs, which `status` tells, as it will tell how it ended.

        Raises:
            CannotFork: it could not be started.
        """
        self._lines = status
        first = self._lines.readline().strip()
        if not first.isdigit():
            self._lines.close()
            raise CannotFork(first or "what was to start it has ended")
        self.pid = int(first)
        """The program's pid on the host."""
        self._exit_code: int | None = None

    def exit_code(self) -> int:
        """Return the exit status of a program that has ended, negative for a signal."""
        if self._exit_code is None:
            last = self._lines.readline().strip()
            self._lines.close()
            self._exit_code = int(last) if last else -signal.SIGKILL  # what waited for it was killed, too
        return self._exit_code


class WarmPython:
    """A process that has imported what nodes import, to be forked by `start`. A context manager: leaving it ends that.

    Args:
        environment: of the sandboxes in which programs will be started.
        channel: the `channel` of another WarmPython, perhaps in another process, to use the same; None to start one.
    """

    def __init__(self, environment: Mapping[str, str], channel: int | None = None) -> None:
        self._environment = dict(environment)
        self._usable = True
        self._popen: subprocess.Popen[bytes] | None = None
        if channel is not None:
            self._socket = socket.socket(fileno=channel)
            self._socket.set_inheritable(False)
            return
        self._socket, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with theirs, _SCRIPT.open("rb") as script:
            # By its descriptor: a program can see the name of what has been forked, which is no path of this machine.
            command: list[str] = [*DEFAULT_SIGNALS, "python3", f"/dev/fd/{script.fileno()}", str(IMPORTS)]
            self._popen = subprocess.Popen(
                command,
                stdin=theirs.fileno(),
                env=self._environment,
                pass_fds=[script.fileno()],
                start_new_session=True,
            )

    def __enter__(self) -> WarmPython:
        """Return the process."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """End the process. Programs that it has started go on."""
        self.close()

    def close(self) -> None:
        """End the process, if this has started it. Programs that it has started go on."""
        self._socket.close()
        if self._popen is not None:
            self._popen.kill()
            self._popen.wait()

    @property
    def channel(self) -> int:
        """The file descriptor on which it is asked to start programs."""
        return self._socket.fileno()

    @cached_property
    def _loaded(self) -> frozenset[str]:
        """The names of the modules that it has imported, without those of packages' parts; empty if it has ended."""
        with self._send(_LOADED) as answer, contextlib.suppress(ValueError):
            return frozenset(json.loads(answer.read()))
        return frozenset()

    def _send(self, request: bytes, *descriptors: int) -> TextIO:
        """Send a request and return what the answer can be read from: nothing if the process has ended."""
        read_end, write_end = os.pipe()
        try:
            socket.send_fds(self._socket, [request], [write_end, *descriptors])
        except OSError:
            self._usable = False
        finally:
            os.close(write_end)
        return os.fdopen(read_end)

    def suits(self, command: Sequence[str], box: Sandbox) -> bool:
        """Return whether `command` in `box` is a program that would not notice how it was started.

        It has to be a Python program that would find the same modules if it imported them itself, and load the same
        libraries.
        """
        if not self._usable or namespaces.confinement() is not NAMESPACES or not box.network or box.writable:
            return False
        if {**box.environment, _DIFFERS: ""} != {**self._environment, _DIFFERS: ""}:
            return False
        given = _words(command)[0]
        script = _on_host(Path(given), box)
        if script is None or not (_is_python(script) if given == command[0] else script.exists()):
            return False
        paths = [Path(path) for path in box.environment["PYTHONPATH"].split(":") if path != str(AT_START)]
        own = script if script.is_dir() else script.parent
        folders = [own, *(folder for path in paths if (folder := _on_host(path, box)) and folder.is_dir())]
        modules = {entry.name.split(".")[0] for folder in folders for entry in folder.iterdir()} - {"__main__"}
        return (
            bool(self._loaded)
            and not modules & (self._loaded | _AT_START)
            and _are_of_types([library.name for library in _own_libraries(box)])
        )

    def start(
        self, command: Sequence[str], box: Sandbox, limits: Limits,
        *, init: int, output: int, user: int | None, group: cgroup.Group, hold: int,
    ) -> Program:  # fmt: skip
        """Start `command` in the sandbox whose first process is `init` (a pid on the host) and return the program.

        Args:
            command: a program that `suits`.
            box: the sandbox's description.
            limits: the program's resource limits.
            init: the first process of the sandbox.
            output: the file descriptor to which the program writes.
            user: as whom it runs, None for the user who grades.
            group: the sandbox's cgroup.
            hold: a file descriptor that is open elsewhere until the program has ended.

        Raises:
            CannotFork: it cannot be started in this way.
        """
        request = {
            "init": init, "command": _words(command), "cwd": box.cwd,
            "environment": {**box.environment, "PWD": box.cwd},
            "limits": resource_limits(limits), "user": user, "groups": group.procs_files,
            "libraries": [str(path) for path in _own_libraries(box, inside=True) if not path.name.endswith("_cpp.so")],
            "filter": PROGRAM_BYTES.hex(),
            "offers_forks": _FORKS_VARIABLE if tuple(command[: len(LAUNCH)]) == LAUNCH else "",
        }  # fmt: skip
        try:
            return Program(self._send(json.dumps(request).encode(), output, hold))
        except CannotFork:
            self._usable = False
            raise


def _words(command: Sequence[str]) -> list[str]:
    """Return a script's path and its arguments, whether the script is a command or `python3` runs it."""
    return list(command[1:] if command[0] == "python3" else command)


def _is_python(script: Path) -> bool:
    """Return whether the kernel would run a file by the same Python as the warm process's."""
    text = untrusted.read_bytes(script, _LONGEST_SCRIPT)
    return text is not None and _FIRST_LINE.match(text) is not None and os.access(script, os.X_OK)


def _on_host(path: Path, box: Sandbox) -> Path | None:
    """Return where a path of the sandbox is on the host, None if no mount of the box has it."""
    for host, inside in box.read_only.items():
        if path.is_relative_to(inside):
            return host / path.relative_to(inside)
    return None


def _own_libraries(box: Sandbox, *, inside: bool = False) -> list[Path]:
    """Return the shared libraries that the box adds to the kit's, as paths on the host or `inside` the sandbox."""
    folders = [Path(path) for path in box.environment["LD_LIBRARY_PATH"].split(":")]
    found = [(folder, _on_host(folder, box)) for folder in folders]
    return [
        folder / library.name if inside else library
        for folder, host in found
        if host is not None
        for library in _libraries_of(host)
    ]


@cache
def _kit_libraries() -> frozenset[str]:
    folders = [Path(path) for path in ros_env.library_path().split(":")]
    return frozenset(library.name for folder in folders for library in _libraries_of(folder))


def _are_of_types(libraries: Sequence[str]) -> bool:
    """Return whether these are libraries that rosidl makes for one package, which is not the kit's.

    A node that uses the types loads all of them but those for C++, so a fork may load these at its start. In any other
    there may be code that the program never loads.
    """
    packages = {match and match[1] for match in map(_TYPE_LIBRARY.fullmatch, libraries)}
    return len(packages) <= 1 and None not in packages and not _kit_libraries() & set(libraries)


def _libraries_of(folder: Path) -> list[Path]:
    return sorted(folder.glob("lib*.so*")) if folder.is_dir() else []
