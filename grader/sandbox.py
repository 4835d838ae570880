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
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from types import TracebackType

from grader import cgroup, disk, processes, shortage, toolchain
from grader.errors import GraderError
from grader.work_clock import WorkClock

MIB = 1024 * 1024
HOME = Path("/home/student")

# Configuration that the loader, the resolver and Python ask for; nothing of the host's users or services.
_ETC = ("alternatives", "ld.so.cache", "ld.so.conf", "ld.so.conf.d", "localtime", "nsswitch.conf", "hosts")
UNSAFE_VARIABLE = "ROS2_COURSE_KIT_UNSAFE_NO_SANDBOX"
UNSAFE_WORDS = (
    "Graded with --unsafe-no-sandbox: the submission's code saw this machine's processes and network, and other "
    "gradings. Its points can be trusted no more than the submission itself."
)

_LOOKS_EVERY_S = 1.0  # at how long a command has waited for a core
_LONGEST = 4  # times its time limit a command may take on a machine that is busy with others

_ROOT_FOLDERS = ("bin", "sbin", "lib", "lib32", "lib64", "libx32")


@dataclass(frozen=True)
class Limits:
    """What one walled-in command may use. A process that goes beyond is stopped, not slowed.

    `memory_bytes` is what each process may ask for, `resident_bytes` what all behind the wall may really take together,
    disks in memory included; that and `processes` as a whole need cgroups. `disk_bytes` and `files` are for what is
    left in all writable folders together.
    """

    wall_seconds: float = 60.0
    memory_bytes: int = 4096 * MIB
    resident_bytes: int = 4096 * MIB
    processes: int = 512
    file_bytes: int = 256 * MIB
    output_bytes: int = 1 * MIB
    disk_bytes: int = 1024 * MIB
    files: int = 100_000


@dataclass(frozen=True)
class Wall:
    """What a walled-in command sees. `read_only` and `writable` map host paths to paths inside."""

    read_only: Mapping[Path, str] = field(default_factory=dict)
    writable: Mapping[Path, str] = field(default_factory=dict)
    environment: Mapping[str, str] = field(default_factory=dict)
    cwd: str = "/tmp"
    network: bool = False
    """Keep the caller's network namespace (a trial's own loopback) instead of having none at all."""


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

    def __init__(self, command: Sequence[str], wall: Wall, limits: Limits) -> None:
        self._limits = limits
        self.started = time.monotonic()
        self._group = cgroup.make(limits.resident_bytes, limits.processes)
        read_end, write_end = os.pipe()
        gate, opener = os.pipe()
        walled = [*_bwrap(wall, info_fd=write_end), *_BEHIND_GATE, *_limited(command, limits)]
        try:
            self._popen = subprocess.Popen(
                [*_held(self._group), *walled],
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
            disk.Guard(list(wall.writable), limits.disk_bytes, limits.files, self.end) if wall.writable else None
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
        for pid in processes.children(self._init_pid):
            _signal(pid, signal.SIGINT)

    def shares(self) -> dict[int, tuple[float, float]]:
        """Return for each thread of the whole tree the seconds that it has run, and has waited for a core."""
        return processes.shares(processes.descendants(self._init_pid))

    def hold_to(self, cores: Iterable[int]) -> None:
        """Let the whole tree run on these cores only."""
        processes.hold_to(cores, processes.descendants(self._init_pid))

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


def run(command: Sequence[str], wall: Wall, limits: Limits | None = None) -> RunResult:
    """Run `command` walled in, wait for its end or its time limit, and return how it went.

    Raises:
        GraderError: the wall cannot be built on this host.
    """
    limits = limits or Limits()
    with Process(command, wall, limits) as process:
        exit_code = process.wait_for_work(limits.wall_seconds)
        seconds = process.wall_seconds
    output = process.output
    if exit_code is not None and output.startswith("bwrap: "):
        raise GraderError(
            f"The wall could not be built: {output.strip()[:500]}. Run `grader doctor`; it says how to mend it. "
            "To grade with hardly any wall, which no grade should rest on, say --unsafe-no-sandbox."
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
    tried = run(["true"], Wall())
    if not tried.ok:
        raise GraderError(
            f"Nothing can be run behind a wall here: {tried.output.strip()[:300]}. Run `grader doctor`; where a limit "
            "cannot be set, somebody has set a lower one for the grader: `ulimit -a` shows it."
        )


def private_network(command: Sequence[str]) -> list[str]:
    """Return the command line that runs a trusted `command` in a network namespace of its own, with loopback only.

    The host's /proc stays in sight: over a /proc of bubblewrap's making (parts of it are read-only) the kernel refuses
    the walls inside one of their own.
    """
    if unsafe():
        return list(command)
    outer = ["bwrap", "--dev-bind", "/", "/", "--tmpfs", "/dev/shm", "--unshare-net", "--unshare-ipc"]
    return [*outer, "--die-with-parent", "--", *command]


def unsafe() -> bool:
    """Return whether somebody has asked for gradings without walls between processes and networks."""
    return os.environ.get(UNSAFE_VARIABLE) == "1"


def _namespaces(network: bool) -> list[str]:
    """Return the walls between processes, users and networks; with --unsafe-no-sandbox there are hardly any.

    What stays then is what the kit cannot work without: a file system of its own, in which its paths are the same in
    every grading, and a pid namespace, without which "end everything that this test has started" would end the host.
    """
    if unsafe():
        return ["--unshare-pid", "--ro-bind", "/proc", "/proc"]
    own = ["--unshare-user", "--unshare-pid", "--unshare-ipc", "--unshare-uts", "--unshare-cgroup-try"]
    return [*own, *([] if network else ["--unshare-net"]), "--hostname", "robot", "--proc", "/proc"]


def _bwrap(wall: Wall, info_fd: int) -> list[str]:
    arguments = [
        "bwrap", *_namespaces(wall.network), "--die-with-parent", "--new-session", "--cap-drop", "ALL",
        "--info-fd", str(info_fd), "--clearenv", "--dev", "/dev", *_memory_disk("/dev/shm", 256 * MIB),
        "--remount-ro", "/dev",
        *_memory_disk("/tmp", 1024 * MIB), *_memory_disk("/home", 256 * MIB), "--dir", str(HOME),
        *_memory_disk("/run", 16 * MIB), "--dir", "/var/tmp", "--ro-bind", "/usr", "/usr",
    ]  # fmt: skip
    for name in _ROOT_FOLDERS:
        path = Path("/", name)
        if path.is_symlink():
            arguments += ["--symlink", str(path.readlink()), str(path)]
        elif path.is_dir():
            arguments += ["--ro-bind", str(path), str(path)]
    for name in _ETC:
        arguments += ["--ro-bind-try", f"/etc/{name}", f"/etc/{name}"]
    for prefix in (toolchain.BASE_PREFIX, toolchain.PREFIX):
        if not prefix.is_relative_to("/usr"):
            arguments += ["--ro-bind", str(prefix), str(prefix)]
    for ours in _own_sources():
        arguments += ["--tmpfs", str(ours)]
    for host, inside in wall.read_only.items():
        arguments += ["--ro-bind", str(host), inside]
    for host, inside in wall.writable.items():
        arguments += ["--bind", str(host), inside]
    for name, value in wall.environment.items():
        arguments += ["--setenv", name, value]
    # What is mounted below stays as it is; the root itself would be another disk in memory.
    return [*arguments, "--remount-ro", "/", "--chdir", wall.cwd, "--"]


def _memory_disk(path: str, size: int) -> list[str]:
    """Return the arguments for a disk in memory. Without a size it would take up to half of the machine's."""
    return [*(["--size", str(size)] if _knows_size() else []), "--tmpfs", path]


@cache
def _knows_size() -> bool:
    """Return whether this bubblewrap can limit a disk in memory; those before 0.6 cannot."""
    with contextlib.suppress(OSError, subprocess.SubprocessError):
        told = subprocess.run(["bwrap", "--help"], capture_output=True, text=True, check=False, timeout=10)
        return "--size" in told.stdout + told.stderr
    return False


def _held(group: cgroup.Group) -> list[str]:
    """Return the start of a command line that puts itself, and so all that it starts, into the group."""
    if not group.doors:
        return []
    script = 'n=$1; shift; while [ "$n" -gt 0 ]; do echo $$ >"$1" || exit 97; shift; n=$((n - 1)); done; exec "$@"'
    return ["sh", "-c", script, "held", str(len(group.doors)), *group.doors]


# Goes on when somebody opens the gate, its standard input, and gives up when nobody can any more. bubblewrap asks the
# kernel to end it with its parent; a grader that is killed before that would leave a wall behind. The gate opens after.
_BEHIND_GATE = ("sh", "-c", 'read -r go || exit 96; exec "$@" </dev/null', "gate")


def _own_sources() -> list[Path]:
    """Return the folders with trials and checks that would show through the wall: none in an editable install."""
    kit = Path(__file__).resolve().parent
    folders = [kit, kit.parent / "sim"]
    return [folder for folder in folders if folder.is_dir() and _shows_through(folder)]


def _shows_through(folder: Path) -> bool:
    return any(folder.is_relative_to(prefix) for prefix in (toolchain.PREFIX, toolchain.BASE_PREFIX, Path("/usr")))


def _limited(command: Sequence[str], limits: Limits) -> list[str]:
    return [
        # A grader in the background of a script has SIGINT ignored, which its children would inherit for good.
        "env", "--default-signal=HUP,INT,QUIT,TERM",
        "prlimit", f"--as={limits.memory_bytes}", f"--nproc={limits.processes}", f"--fsize={limits.file_bytes}",
        "--nofile=1024", "--core=0", f"--cpu={int(limits.wall_seconds) * 2 + 10}", "--", *command,
    ]  # fmt: skip


def _child_pid(read_end: int) -> int:
    """Return the pid (as seen from here) of the first process in the wall, 0 if the wall was never built."""
    with os.fdopen(read_end, "rb") as stream:
        text = stream.read()
    return int(json.loads(text)["child-pid"]) if text else 0


def _signal(pid: int, number: signal.Signals) -> None:
    with contextlib.suppress(ProcessLookupError):
        os.kill(pid, number)
