"""Start a command as another user, without namespaces: the first process of a sandbox on a machine that forbids them.

Run by path with a plain Python, as root or as the user who checks. It forks: the child gives up every right and becomes
proot, below which the command runs (user_command.py); this process kills what is left of that user when the command has
ended, or when it is asked to with SIGTERM. With users, a second child, the killer, does that: it was forked before the
command could use up all processes, and acts when this process is killed, too. See landlock(7), prctl(2), setresuid(2).
"""

from __future__ import annotations

import contextlib
import ctypes
import json
import os
import re
import select
import signal
import struct
import sys
from pathlib import Path
from typing import Any, NoReturn

from user_command import INFO, STATUS  # type: ignore[import-not-found]  # beside this file, which is run by path

_CREATE_RULESET, _ADD_RULE, _RESTRICT_SELF = 444, 445, 446  # <asm/unistd_64.h>
# <linux/landlock.h>: all rights on files by version of the interface, those on a file that is no folder, reading.
_RIGHTS = {1: (1 << 13) - 1, 2: (1 << 14) - 1, 3: (1 << 15) - 1, 5: (1 << 16) - 1}
_OF_FILES = 0b1 | 0b10 | 0b100 | 1 << 14 | 1 << 15
_READ = 0b1 | 0b100 | 0b1000
_TCP, _ABSTRACT_SOCKETS_AND_SIGNALS = 3, 3
# <linux/prctl.h>, <linux/capability.h>
_DIE_WITH_PARENT, _SUBREAPER = 1, 36
_DROP_FROM_BOUNDING_SET, _SET_NO_NEW_PRIVILEGES, _AMBIENT, _CLEAR_AMBIENT = 24, 38, 47, 4
_CAPABILITIES_3, _CAPABILITIES = 0x20080522, 64

_libc = ctypes.CDLL(None, use_errno=True)


def main() -> None:
    """Run the command that the argument, JSON, asks for, and exit with its status; 128 + N if signal N killed it."""
    asked: dict[str, Any] = json.loads(sys.argv[1])
    alive, living = os.pipe()
    killer = 0 if asked["user"] is None else os.fork()
    if asked["user"] is not None and killer == 0:
        kill_when_closed(alive, asked["user"], asked["killer"])
    os.close(alive)
    (status, report), (told, tell) = os.pipe(), os.pipe()
    wake, woken = os.pipe()
    os.set_blocking(woken, False)
    signal.set_wakeup_fd(woken)
    signal.signal(signal.SIGTERM, lambda *_: None)
    _call("prctl", _SUBREAPER, 1, 0, 0, 0)
    _call("prctl", _DIE_WITH_PARENT, signal.SIGTERM, 0, 0, 0)
    parent = os.getpid()
    if (child := os.fork()) == 0:
        become(asked, parent, report, tell)
    for descriptor in (report, tell):
        os.close(descriptor)
    os.write(asked["info"], os.read(told, 64))
    os.close(asked["info"])
    ready, _, _ = select.select([status, wake], [], [])
    said = os.read(status, 16) if status in ready else b""  # nothing, if what was to report it was killed
    os.close(living)
    kill_all(child, killer)
    clean_up(asked["user"], child)
    code = int(said or -signal.SIGKILL)
    sys.exit(128 - code if code < 0 else code)


def become(asked: dict[str, Any], parent: int, report: int, tell: int) -> None:
    """Become the command."""
    os.setsid()
    die_with(parent)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    with contextlib.suppress(OSError):  # when memory runs out, the submission has to go first
        Path("/proc/self/oom_score_adj").write_text("1000")
    if asked["landlock"] is not None:
        restrict(**asked["landlock"])
    give_up_rights(asked["user"])
    os.dup2(tell, INFO)
    os.dup2(report, STATUS)
    os.closerange(3, INFO)
    os.closerange(STATUS + 1, 65536)
    os.chdir("/")
    os.execvpe(asked["command"][0], asked["command"], asked["environment"])


def give_up_rights(user: int | None) -> None:
    """Become `user`, if there is one, and give up every capability for good."""
    for number in range(_CAPABILITIES):
        _libc.prctl(_DROP_FROM_BOUNDING_SET, number, 0, 0, 0)  # fails above the last one that this kernel has
    if user is not None:
        os.setgroups([])
        os.setresgid(user, user, user)
        os.setresuid(user, user, user)
    _call("prctl", _AMBIENT, _CLEAR_AMBIENT, 0, 0, 0)
    _call("capset", struct.pack("=Ii", _CAPABILITIES_3, 0), bytes(24))
    _call("prctl", _SET_NO_NEW_PRIVILEGES, 1, 0, 0, 0)


def restrict(read: list[str], write: list[str]) -> None:
    """Let this process and all it starts reach these paths alone, no TCP, and no signal or abstract socket of others.

    As far as this kernel has that: versions 1 to 3 of the interface know files, 4 TCP, 6 the rest. None is no error.
    """
    version = _libc.syscall(_CREATE_RULESET, None, 0, 1)
    if version < 1:
        return
    rights = _RIGHTS[max(known for known in _RIGHTS if known <= version)]
    fields = struct.pack("=QQQ", rights, _TCP, _ABSTRACT_SOCKETS_AND_SIGNALS)
    fields = fields[: 8 if version < 4 else 16 if version < 6 else 24]
    ruleset = _libc.syscall(_CREATE_RULESET, fields, len(fields), 0)
    for paths, allowed in ((read, _READ), (write, rights)):
        for path in paths:
            with contextlib.suppress(FileNotFoundError):
                descriptor = os.open(path, os.O_PATH)
                wanted = allowed if Path(path).is_dir() else allowed & _OF_FILES & rights
                if _libc.syscall(_ADD_RULE, ruleset, 1, struct.pack("=Qi", wanted, descriptor), 0):
                    raise OSError(ctypes.get_errno(), f"Landlock does not take {path}")
                os.close(descriptor)
    _call("prctl", _SET_NO_NEW_PRIVILEGES, 1, 0, 0, 0)
    if _libc.syscall(_RESTRICT_SELF, ruleset, 0):
        raise OSError(ctypes.get_errno(), "Landlock refuses")
    os.close(ruleset)


def kill_when_closed(pipe: int, user: int, killer: int) -> NoReturn:
    """Kill every process of the user once no process holds the pipe's other end any more.

    As the user `killer`, none of whose processes are the submission's: it cannot kill this one first.
    """
    os.dup2(pipe, 0)
    os.closerange(1, 65536)
    os.read(0, 1)
    os.setresuid(killer, user, killer)
    with contextlib.suppress(ProcessLookupError):
        os.kill(-1, signal.SIGKILL)  # all at one moment, so that none can start another one meanwhile
    os._exit(0)


def kill_all(child: int, killer: int) -> None:
    """Kill the child and all it has started, which the killer does, too, and wait until no process is left."""
    with contextlib.suppress(ProcessLookupError):
        os.kill(child, signal.SIGKILL)
    with contextlib.suppress(ChildProcessError):  # what lost its parent is a child of this process
        while True:
            for left in own_children():
                with contextlib.suppress(ProcessLookupError):
                    if left != killer:
                        os.kill(left, signal.SIGKILL)
            os.waitpid(-1, 0)


def clean_up(user: int | None, proot: int) -> None:
    """Remove what is left in /tmp: of the user, or without a user of its own what this proot has made there."""
    from shutil import rmtree  # takes 10 ms, and a command waits for none of it here

    for entry in os.scandir("/tmp"):
        with contextlib.suppress(OSError):
            mine = (
                re.match(rf"proot(ed)?-{proot}-", entry.name)
                if user is None
                else entry.stat(follow_symlinks=False).st_uid == user
            )
            if mine and entry.is_dir(follow_symlinks=False):
                rmtree(entry.path, ignore_errors=True)
            elif mine:
                Path(entry.path).unlink()


def die_with(parent: int) -> None:
    """Let the kernel kill this process as soon as its parent ends."""
    _call("prctl", _DIE_WITH_PARENT, signal.SIGKILL, 0, 0, 0)
    if os.getppid() != parent:  # it has ended before
        os._exit(1)


def _call(name: str, *arguments: Any) -> None:
    if getattr(_libc, name)(*arguments) != 0:
        raise OSError(ctypes.get_errno(), f"{name}: {os.strerror(ctypes.get_errno())}")


def own_children() -> list[int]:
    """Return the pids of this process's children."""
    try:
        return list(map(int, Path(f"/proc/self/task/{os.getpid()}/children").read_text().split()))
    except OSError:
        return []


if __name__ == "__main__":
    main()
