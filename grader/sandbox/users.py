"""The command line that runs a command as another user, where no namespaces can be made. The second kind of sandbox.

What a sandbox sees lies in one folder that its user alone may enter; proot, which traces its processes, shows it at
the same paths as bubblewrap does. That is for comfort, not for safety: what holds is that the user owns nothing and
may read nothing of the grader's, Landlock, the filter of kernel calls, and limits.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from grader.errors import GraderError
from grader.host import ros_env, submission_user, tempdir
from grader.sandbox.bwrap import _ETC, _ROOT_FOLDERS, HOME, Sandbox
from grader.sandbox.syscall_filter import PROGRAM_BELOW_PROOT
from grader.words import say

_START = Path(__file__).with_name("user_start.py")
# Its text is run below proot, which needs some of the calls that the filter refuses.
_COMMAND = Path(__file__).with_name("user_command.py")
_DEVICES = ("null", "zero", "full", "random", "urandom", "tty")
_OWN = ("tmp", "home", "shm", "run")
# proot 5 keeps one record of the heaps of a process and all that it starts by posix_spawn, which then crash: each gets
# its whole heap at once, and builds start one process at a time.
_FOR_PROOT = {"MALLOC_TOP_PAD_": str(64 << 20), "MAKEFLAGS": "-j1", "CMAKE_BUILD_PARALLEL_LEVEL": "1"}


@dataclass
class View:
    """The folder with what one sandbox sees, and what was moved into it: each with the place where it belongs."""

    folder: Path
    binds: dict[str, Path] = field(default_factory=dict)
    moved: dict[Path, Path] = field(default_factory=dict)

    @property
    def own(self) -> list[Path]:
        """Return what bubblewrap would make disks in memory of: folders that the sandbox may fill."""
        return [self.folder / name for name in _OWN]

    def close(self) -> None:
        """Put back what was moved here, and remove the rest."""
        for host, here in self.moved.items():
            host.unlink()
            _move(here, host)
        tempdir.remove(self.folder)


def lay_out(box: Sandbox, user: int | None) -> View:
    """Make the folder that a sandbox sees, for its user alone."""
    made = Path(tempfile.mkdtemp(prefix=f"view-{os.getpid()}-", dir=_place(user)))
    view = View(made)
    for name in _OWN:
        (made / name).mkdir()
    if user is None:
        view.binds = {inside: host for host, inside in [*box.read_only.items(), *box.writable.items()]}
        return view
    submission_user.give(view.own, user)
    for number, (host, inside) in enumerate([*box.read_only.items(), *box.writable.items()]):
        here = view.binds[inside] = made / str(number)
        if host in box.writable or host in box.fed:
            _move(host, here)
            host.symlink_to(here)
            view.moved[host] = here
        elif host.is_dir():
            shutil.copytree(host, here, symlinks=True, copy_function=_link)
        else:
            shutil.copy2(host, here)
    os.chown(made, 0, user)
    made.chmod(0o710)
    return view


def command_line(
    command: Sequence[str], box: Sandbox, view: View, *, user: int | None, info_fd: int, locked: bool = True
) -> list[str]:
    """Return the command line that runs `command` in the view; its first process reports the next one's pid."""
    own = {"/tmp": "tmp", str(HOME): "home", "/dev/shm": "shm", "/run": "run"}
    binds = (
        {inside: view.folder / name for inside, name in own.items()}
        | {str(p): p for p in submission_user.prefixes()}
        | view.binds
    )
    run = [
        submission_user.PROOT,
        "--verbose=-1",
        *(f"--bind={host}:{inside}" for inside, host in binds.items()),
        f"--pwd={box.cwd}",
    ]
    python = str(ros_env.BASE_PREFIX / "bin" / "python3")
    run += [python, "-I", "-S", "-c", _COMMAND.read_text(), PROGRAM_BELOW_PROOT.hex(), *command]
    write = [Path("/tmp")]  # where proot itself makes files
    write += [*(view.binds[inside] for inside in box.writable.values()), *view.own]
    write += [view.binds[box.read_only[pipe.parent]] / pipe.name for pipe in box.pipes]
    read = [Path("/", name) for name in ("usr", "proc", *_ROOT_FOLDERS)] + [Path("/etc", name) for name in _ETC]
    devices = [Path("/dev", name) for name in _DEVICES]
    read += [*submission_user.prefixes(), *view.binds.values()]
    asked = {
        "user": user, "killer": submission_user.new_id(), "command": run, "info": info_fd,
        "environment": _FOR_PROOT | dict(box.environment),
        "landlock": {"read": [*map(str, read)], "write": [*map(str, (*write, *devices))]} if locked else None,
    }  # fmt: skip
    return [sys.executable, "-s", "-S", "-E", str(_START), json.dumps(asked)]


def _place(user: int | None) -> Path:
    """Return the folder for views: where other users may pass, but not look, if there are any."""
    if user is None:
        return tempdir.parent()
    place = submission_user.VIEWS
    place.mkdir(mode=0o711, exist_ok=True)
    if place.stat().st_uid != 0:
        raise GraderError(say("{path} belongs to another user. Remove it and grade again.", path=place))
    place.chmod(0o711)
    tempdir.sweep(place, "view")
    return place


def _move(source: Path, target: Path) -> None:
    """Move a folder, also to another disk, with its owners and whatever a submission has left in it."""
    subprocess.run(["mv", "-T", "--", str(source), str(target)], capture_output=True, check=True)


def _link(source: str, target: str) -> str:
    """Link a file, or copy it to another disk."""
    try:
        os.link(source, target, follow_symlinks=False)
    except OSError:
        if Path(source).is_fifo():  # what is written into another one reaches nobody
            os.mkfifo(target)
        else:
            shutil.copy2(source, target, follow_symlinks=False)
    return target
