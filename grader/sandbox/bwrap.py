"""The command line that puts a command into a sandbox: bubblewrap, cgroups, limits of the kernel."""

from __future__ import annotations

import contextlib
import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

from grader import KIT
from grader.host import cgroup, namespaces, ros_env

MIB = 1024 * 1024


HOME = Path("/home/student")


# Configuration that the loader, the resolver and Python ask for; nothing of the host's users or services.
_ETC = ("alternatives", "ld.so.cache", "ld.so.conf", "ld.so.conf.d", "localtime", "nsswitch.conf", "hosts")


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
class Sandbox:
    """What a walled-in command sees. `read_only` and `writable` map host paths to paths inside."""

    read_only: Mapping[Path, str] = field(default_factory=dict)
    writable: Mapping[Path, str] = field(default_factory=dict)
    environment: Mapping[str, str] = field(default_factory=dict)
    cwd: str = "/tmp"
    network: bool = False
    """Keep the caller's network namespace (a trial's own loopback) instead of having none at all."""


def _namespaces(network: bool) -> list[str]:
    """Return the walls between processes, users and networks; with --unsafe-no-sandbox there are hardly any.

    What stays then is what the kit cannot work without: a file system of its own, in which its paths are the same in
    every grading, and a pid namespace, without which "end everything that this test has started" would end the host.
    """
    if namespaces.unsafe():
        return ["--unshare-pid", "--ro-bind", "/proc", "/proc"]
    own = ["--unshare-user", "--unshare-pid", "--unshare-ipc", "--unshare-uts", "--unshare-cgroup-try"]
    return [*own, *([] if network else ["--unshare-net"]), "--hostname", "robot", "--proc", "/proc"]


def bwrap_command(box: Sandbox, info_fd: int) -> list[str]:
    """Return the start of a command line that runs the rest in `wall`; bwrap reports the child's pid to `info_fd`."""
    arguments = [
        "bwrap", *_namespaces(box.network), "--die-with-parent", "--new-session", "--cap-drop", "ALL",
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
    for prefix in (ros_env.BASE_PREFIX, ros_env.PREFIX):
        if not prefix.is_relative_to("/usr"):
            arguments += ["--ro-bind", str(prefix), str(prefix)]
    for ours in _own_sources():
        arguments += ["--tmpfs", str(ours)]
    for host, inside in box.read_only.items():
        arguments += ["--ro-bind", str(host), inside]
    for host, inside in box.writable.items():
        arguments += ["--bind", str(host), inside]
    for name, value in box.environment.items():
        arguments += ["--setenv", name, value]
    # What is mounted below stays as it is; the root itself would be another disk in memory.
    return [*arguments, "--remount-ro", "/", "--chdir", box.cwd, "--"]


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


def in_cgroup(group: cgroup.Group) -> list[str]:
    """Return the start of a command line that puts itself, and so all that it starts, into the group."""
    if not group.doors:
        return []
    script = 'n=$1; shift; while [ "$n" -gt 0 ]; do echo $$ >"$1" || exit 97; shift; n=$((n - 1)); done; exec "$@"'
    return ["sh", "-c", script, "held", str(len(group.doors)), *group.doors]


# Goes on when somebody opens the gate, its standard input, and gives up when nobody can any more. bubblewrap asks the
# kernel to end it with its parent; a grader that is killed before that would leave a wall behind. The gate opens after.
BEHIND_GATE = ("sh", "-c", 'read -r go || exit 96; exec "$@" </dev/null', "gate")


def _own_sources() -> list[Path]:
    """Return the folders with trials and checks that would show through the wall: none in an editable install."""
    folders = [KIT / "grader", KIT / "sim"]
    return [folder for folder in folders if folder.is_dir() and _shows_through(folder)]


def _shows_through(folder: Path) -> bool:
    return any(folder.is_relative_to(prefix) for prefix in (ros_env.PREFIX, ros_env.BASE_PREFIX, Path("/usr")))


def with_limits(command: Sequence[str], limits: Limits) -> list[str]:
    """Return the command line that runs `command` under the kernel's limits for each process."""
    return [
        # A grader in the background of a script has SIGINT ignored, which its children would inherit for good.
        "env", "--default-signal=HUP,INT,QUIT,TERM",
        "prlimit", f"--as={limits.memory_bytes}", f"--nproc={limits.processes}", f"--fsize={limits.file_bytes}",
        "--nofile=1024", "--core=0", f"--cpu={int(limits.wall_seconds) * 2 + 10}", "--", *command,
    ]  # fmt: skip
