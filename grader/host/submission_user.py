"""The user as whom submissions run where the grader is root: one that owns nothing on this machine.

In a sandbox of root's a process could be root of this machine too, held back by nothing but read-only mounts. So it
runs as a user of its own instead. Any other grader's sandboxes run as the user who grades.
"""

from __future__ import annotations

import os
import secrets
import shutil
import subprocess
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from pathlib import Path

from grader import KIT
from grader.errors import GraderError
from grader.host import namespaces, ros_env
from grader.words import mark, say

# systemd's list of user ids leaves 1,879,048,192 to 2,147,483,647 to nobody. A container with few ids has these ones of
# ordinary users, of whom it seldom has any.
_IDS = (range(1_900_000_000, 2_000_000_000), range(20_000, 60_000))
_NOBODY = 65534
# Between the mounts, which root makes, and the first command of the submission.
CAPABILITIES = ("--cap-drop", "ALL", "--cap-add", "CAP_SETUID", "--cap-add", "CAP_SETGID")
RUNS_AS_ROOT = mark(
    "The grader ran as root and could not run the submission's code as another user; only the sandbox's read-only "
    "mounts kept it from this machine's files. Grade as an ordinary user."
)
PROOT = "proot"
VIEWS = Path("/var/tmp/ros2-course-kit")
"""Where root keeps what sandboxes without namespaces see."""
_PROBE_SECONDS = 300  # takes 20 ms
# Reads what every sandbox must be able to read, and then tries to write a file of root's.
_PROBE = (
    'id -u && head -c1 "$1" "$2" >/dev/null && '
    'if (echo written >>"$3") 2>/dev/null; then echo "it can write files of root" >&2; exit 1; fi'
)


def choose() -> int | None:
    """Return the id of a user for one sandbox; None if its commands run as the user who grades.

    Each sandbox gets a user of its own, so that limits on a user's processes are not shared.
    """
    if os.geteuid() != 0:
        return None
    if namespaces.refusal():  # a submission that kills all it may kill must not be root
        return new_id()
    return None if namespaces.sandbox_disabled() or refusal() else new_id()


def runs_as_root() -> bool:
    """Return whether submissions run as root here."""
    return os.geteuid() == 0 and choose() is None


def notice() -> str:
    """Return in a sentence as whom the submission runs, if root grades; "" for any other user."""
    if os.geteuid() != 0:
        return ""
    if runs_as_root():
        return say("grading as root; the submission runs as root too")
    return say("grading as root; the submission runs as a user that owns nothing")


def lacks() -> str:
    """Return what keeps sandboxes without namespaces from working on this machine, "" if nothing does."""
    if shutil.which(PROOT) is None:
        return say("proot is not installed")
    root = os.geteuid() == 0
    if root and not _is_mapped(new_id()):
        return say("this container has no other user's id")
    for path in prefixes() if root else ():
        if not all(folder.stat().st_mode & 0o001 for folder in (path, *path.parents)):
            return say("other users cannot enter {path}, so no submission could start Python from there", path=path)
    if root and not os.access(VIEWS.parent, os.W_OK):
        return say("{path} cannot be written", path=VIEWS.parent)
    tried = _run(
        [*(become(new_id()) if root else ()), PROOT, "--verbose=-1", "--bind=/usr:/ws/probe", "test", "-d", "/ws/probe"]
    )
    return "" if tried.returncode == 0 else tried.stderr.strip().partition("\n")[0][:200] or say("proot does not work")


def prefixes() -> list[Path]:
    """Return where Python and its packages are, if not in /usr."""
    return [prefix for prefix in ros_env.PREFIXES if prefix != Path("/usr")]


def become(user: int) -> list[str]:
    """Return the start of a command line that runs the rest as `user`, without any right of root's."""
    return ["setpriv", f"--reuid={user}", f"--regid={user}", "--clear-groups", "--inh-caps=-all", "--"]


@cache
def refusal() -> str:
    """Return why root cannot run a sandbox as another user on this machine, "" if that works. Tries it really.

    Raises:
        GraderError: no sandbox works at the moment, so that this cannot be told; nothing may run as root for that.
    """
    user = new_id()
    command = [
        "bwrap", "--ro-bind", "/", "/", "--proc", "/proc", "--dev", "/dev", "--unshare-pid", "--unshare-ipc",
        "--die-with-parent", *CAPABILITIES, "--perms", "1777", "--size", "65536", "--tmpfs", "/tmp",
        "--perms", "0644", "--file", "0", "/tmp/file",
        "--ro-bind", str(KIT / "grader"), "/tmp/kit", "--ro-bind", str(ros_env.SITE_PACKAGES), "/tmp/packages",
        "--", *become(user), "sh", "-c", _PROBE, "probe",
        "/tmp/kit/__init__.py", "/tmp/packages/rclpy/__init__.py", "/tmp/file",
    ]  # fmt: skip
    ended = _run(command)
    if ended.returncode == 0 and ended.stdout.strip() == str(user):
        return ""
    if (plain := _run(["bwrap", "--unshare-user", "--ro-bind", "/", "/", "true"])).returncode != 0:
        words = mark("No sandbox can be set up: {why}. Run `grader doctor`; it prints the fix.")
        raise GraderError(say(words, why=namespaces.last_line(plain)))
    return namespaces.last_line(ended)


def _run(command: Sequence[str]) -> subprocess.CompletedProcess[str]:
    try:
        return subprocess.run(
            command, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=_PROBE_SECONDS, check=False
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        words = mark("Cannot start {program} ({why}). Run `grader doctor`; it prints the fix.")
        raise GraderError(say(words, program=command[0], why=error)) from error


@contextmanager
def readable_by_sandboxes() -> Iterator[None]:
    """Let files that are written inside the block be readable by all, as root's must be for a sandbox's user."""
    if os.geteuid() != 0:
        yield
        return
    before = os.umask(0o022)
    try:
        yield
    finally:
        os.umask(before)


def is_readable(path: Path) -> bool:
    """Return whether any user may read a file, or list and enter a folder."""
    wanted = 0o005 if path.is_dir() else 0o004
    return path.stat().st_mode & wanted == wanted


def give(folders: Sequence[Path], user: int) -> None:
    """Make `user` the owner of everything in the folders; the kernel clears set-user-id bits thereby."""
    if folders:
        owner = f"{user}:{user}"
        subprocess.run(["chown", "-Rh", owner, "--", *map(str, folders)], capture_output=True, check=False)


def new_id() -> int:
    """Return the id of a user that belongs to one sandbox alone; that of nobody in a container without such ids."""
    return next(filter(_is_mapped, map(secrets.choice, _IDS)), _NOBODY)


def _is_mapped(number: int) -> bool:
    """Return whether this container has a user and a group of this id."""
    maps = [Path("/proc/self", name).read_text() for name in ("uid_map", "gid_map")]
    lines = [[tuple(map(int, line.split())) for line in text.splitlines()] for text in maps]
    return all(any(first <= number < first + count for first, _, count in ranges) for ranges in lines)
