"""The command line that runs a command in a sandbox: bubblewrap, cgroups, resource limits."""

from __future__ import annotations

import contextlib
import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

from grader import KIT
from grader.host import cgroup, namespaces, ros_env, submission_user

MIB = 1024 * 1024
HOME = Path("/home/student")
AT_START = Path("/ws/at_start")
"""Where a sandbox may have a folder of the grader's: each of its Pythons runs its sitecustomize.py at its start."""
# Configuration that the loader, the resolver and Python read; nothing about the host's users or services.
_ETC = ("alternatives", "ld.so.cache", "ld.so.conf", "ld.so.conf.d", "localtime", "nsswitch.conf", "hosts")
# What container engines make read-only below /proc, and what else a scan by root found writable. Started by root, a
# process in a user namespace is still root for the files there that belong to no namespace: 763 settings could be
# written, core_pattern among them, which runs a program as root on the host at the next crash.
KERNEL_SETTINGS = tuple(
    f"/proc/{name}" for name in ("sys", "sysrq-trigger", "irq", "bus", "fs", "mtrr", "pressure", "acpi", "scsi")
)

_ROOT_FOLDERS = ("bin", "sbin", "lib", "lib32", "lib64", "libx32")


@dataclass(frozen=True)
class Limits:
    """The resources that one command in a sandbox may use. A process that exceeds them is stopped, not slowed down.

    Attributes:
        wall_seconds: time limit, in seconds of wall time.
        memory_bytes: address space of each process.
        resident_bytes: memory of all processes together, including disks in memory. Needs cgroups.
        processes: number of processes; of the sandbox with cgroups, else of the user.
        file_bytes: size of one file.
        output_bytes: the part of stdout and stderr that is kept.
        disk_bytes: growth of all writable folders together.
        files: number of files by which they may grow.
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
    """The file system and environment of a command. `read_only` and `writable` map host paths to paths inside."""

    read_only: Mapping[Path, str] = field(default_factory=dict)
    writable: Mapping[Path, str] = field(default_factory=dict)
    environment: Mapping[str, str] = field(default_factory=dict)
    cwd: str = "/tmp"
    network: bool = False
    """Keep the caller's network namespace (a trial's own loopback) instead of having no network."""
    fed: tuple[Path, ...] = ()
    """Those of `read_only` into which the grader writes while the command runs."""
    pipes: tuple[Path, ...] = ()
    """Named pipes in folders of `read_only` into which the command writes: a read-only mount allows it."""
    trusted: bool = False
    """It runs nothing of a submission, so it keeps the user who grades; root's cache of compiled files stays root's."""
    as_init: bool = False
    """The command is the first process of the pid namespace: nothing in the sandbox can stop or kill it, and it has to
    wait for processes that have lost their parents."""
    asked: bool = False
    """The command reads what the grader tells it while it runs (`Process.tell`); else its standard input is empty."""


def _namespaces(network: bool, user: int | None) -> list[str]:
    """Return the options that isolate processes, users and networks; with --unsafe-no-sandbox very few.

    Root's sandboxes with a user of their own need no user namespace: root may mount without one.

    The kit cannot do without two: a file system of its own, which has the same paths in every grading, and a pid
    namespace, without which "kill everything that this test has started" would kill the host's processes.
    """
    if namespaces.sandbox_disabled():  # and yet bubblewrap works
        return ["--unshare-pid", "--ro-bind", "/proc", "/proc", "--cap-drop", "ALL"]
    own = ["--unshare-pid", "--unshare-ipc", "--unshare-uts", "--unshare-cgroup-try"]
    own += ["--unshare-user", "--cap-drop", "ALL"] if user is None else submission_user.CAPABILITIES
    network_options = [] if network else ["--unshare-net"]
    read_only = [word for path in KERNEL_SETTINGS for word in ("--ro-bind-try", path, path)]
    return [*own, *network_options, "--hostname", "robot", "--proc", "/proc", *read_only]


def bwrap_command(box: Sandbox, info_fd: int, filter_fd: int, user: int | None) -> list[str]:
    """Return the start of a command line that runs the rest in `box`.

    bwrap reports the child's pid to `info_fd` and reads the filter of kernel calls from `filter_fd`. `user` is the
    user on the host as whom the rest runs, None for the user who grades.
    """
    # What bubblewrap makes belongs to root if root has started it.
    writable = [] if user is None else ["--perms", "1777"]
    arguments = [
        "bwrap", *_namespaces(box.network, user), "--die-with-parent", "--new-session", "--seccomp", str(filter_fd),
        "--info-fd", str(info_fd), "--clearenv", *(["--as-pid-1"] if box.as_init else []),
        "--dev", "/dev", *writable, *_memory_disk("/dev/shm", 256 * MIB), "--remount-ro", "/dev",
        *writable, *_memory_disk("/tmp", 1024 * MIB), *writable, *_memory_disk("/home", 256 * MIB),
        *writable, "--dir", str(HOME), *writable, *_memory_disk("/run", 16 * MIB), "--dir", "/var/tmp",
        "--ro-bind", "/usr", "/usr",
    ]  # fmt: skip
    for name in _ROOT_FOLDERS:
        path = Path("/", name)
        if path.is_symlink():
            arguments += ["--symlink", str(path.readlink()), str(path)]
        elif path.is_dir():
            arguments += ["--ro-bind", str(path), str(path)]
    inside = [*map(str, ros_env.PREFIXES), "/etc/hosts", *box.read_only.values(), *box.writable.values()]
    for parent in sorted({str(folder) for path in inside for folder in Path(path).parents} - {"/"}):
        # Those that bubblewrap makes by itself can be the owner's alone.
        arguments += ["--dir", parent]
    for name in _ETC:
        arguments += ["--ro-bind-try", f"/etc/{name}", f"/etc/{name}"]
    for prefix in ros_env.PREFIXES:
        if not prefix.is_relative_to("/usr"):
            arguments += ["--ro-bind", str(prefix), str(prefix)]
    for folder in _exposed_sources():
        arguments += ["--tmpfs", str(folder)]
    for host, place in box.read_only.items():
        arguments += ["--ro-bind", str(host), place]
    for host, place in box.writable.items():
        arguments += ["--bind", str(host), place]
    for name, value in box.environment.items():
        arguments += ["--setenv", name, value]
    # The mounts below stay as they are; a writable root would be one more disk in memory.
    become = [] if user is None else submission_user.become(user)
    return [*arguments, "--remount-ro", "/", "--chdir", box.cwd, "--", *become]


def _memory_disk(path: str, size: int) -> list[str]:
    """Return the arguments for a disk in memory. Without a size it could take half of the machine's memory."""
    return [*(["--size", str(size)] if _knows_size() else []), "--tmpfs", path]


@cache
def _knows_size() -> bool:
    """Return whether this bubblewrap can limit a disk in memory; versions before 0.6 cannot."""
    with contextlib.suppress(OSError, subprocess.SubprocessError):
        done = subprocess.run(["bwrap", "--help"], capture_output=True, text=True, check=False, timeout=10)
        return "--size" in done.stdout + done.stderr
    return False


def enter_cgroup(group: cgroup.Group) -> list[str]:
    """Return the start of a command line that moves itself, and so everything it starts, into the group."""
    if not group.procs_files:
        return []
    script = 'n=$1; shift; while [ "$n" -gt 0 ]; do echo $$ >"$1" || exit 97; shift; n=$((n - 1)); done; exec "$@"'
    return ["sh", "-c", script, "enter", str(len(group.procs_files)), *group.procs_files]


# Waits for a line on standard input before it runs the command; gives up if the pipe is closed. bubblewrap asks the
# kernel to kill it with its parent; were the grader killed before that, the sandbox would stay. The line comes after.
WAIT_FOR_GO = ("sh", "-c", 'read -r go || exit 96; [ "$go" = asked ] || exec </dev/null; exec "$@"', "wait")


def beside_script(folder: str) -> dict[Path, str]:
    """Return what is mounted beside a script in `folder` that uses `grader.sandbox.first_process`."""
    return {Path(__file__).with_name("first_process.py"): f"{folder}/grader/sandbox/first_process.py"}


def _exposed_sources() -> list[Path]:
    """Return the folders of the kit that the mounts would show to a submission: none in an editable install."""
    mounts = (*ros_env.PREFIXES, Path("/usr"))
    folders = [KIT / "grader", KIT / "sim"]
    return [path for path in folders if path.is_dir() and any(path.is_relative_to(mount) for mount in mounts)]


def with_limits(command: Sequence[str], limits: Limits) -> list[str]:
    """Return the command line that runs `command` with resource limits, which the kernel applies to each process."""
    return [
        # A grader in the background of a script ignores SIGINT, and its children would inherit that.
        "env", "--default-signal=HUP,INT,QUIT,TERM",
        "prlimit", f"--as={limits.memory_bytes}", f"--nproc={limits.processes}", f"--fsize={limits.file_bytes}",
        "--nofile=1024", "--core=0", f"--cpu={int(limits.wall_seconds) * 2 + 10}", "--", *command,
    ]  # fmt: skip
