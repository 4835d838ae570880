"""Hold memory and the number of processes of a whole wall, by cgroups: version 2 where delegated, 1 as root.

Resource limits count for each process by itself, and the number of processes is not limited for root at all. A cgroup
counts everything behind one wall together, shared memory and files in memory included. Where none can be made,
resource limits stand in; `grader doctor` says which.
"""

from __future__ import annotations

import contextlib
import itertools
import os
import re
import signal
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

ROOT = Path("/sys/fs/cgroup")
HOST_MEMORY = "memory of the host"
_PREFIX = "ros2-course-kit"
_NUMBERS = itertools.count()
# Waits until its standard input ends, which is when the grader does, and ends what is in the grader's groups by then.
# More than once: what was being started at that moment joins its group a little later.
_GUARD = """
cat >/dev/null
for round in 1 2 3 4 5 6 7 8 9 10; do
    for group in GROUPS; do
        [ -d "$group" ] || continue
        while read -r member; do kill -9 "$member"; done <"$group/cgroup.procs"
        rmdir "$group"
    done
    sleep 0.2
done
"""


@dataclass(frozen=True)
class Hierarchy:
    """Where groups can be made: version 2 below one folder, or version 1 below one folder a controller."""

    version: int
    folders: Mapping[str, Path]


@dataclass
class Group:
    """The cgroup of one wall. Without folders it holds nothing, and resource limits stand in."""

    folders: list[Path] = field(default_factory=list)

    @property
    def doors(self) -> list[str]:
        """Return the files into which a process writes its id to be held."""
        return [str(folder / "cgroup.procs") for folder in self.folders]

    def events(self) -> str:
        """Return what the group had to stop: "memory", "processes" or "".

        HOST_MEMORY if something was ended though the group had not come to its limit: the machine, or a group around
        this one, was out of memory.
        """
        for folder in self.folders:
            if _number(folder / "pids.events", r"^max (\d+)") > 0:
                return "processes"
            killed = _number(folder / "memory.events", r"^oom_kill (\d+)")
            killed += _number(folder / "memory.oom_control", r"^oom_kill (\d+)")
            if killed:
                return "memory" if _full(folder) else HOST_MEMORY
        return ""

    def close(self) -> None:
        """Take the group away. Its processes are dead by now, but the kernel may need a moment to count them out."""
        deadline = time.monotonic() + 2.0
        for folder in self.folders:
            while folder.exists():
                with contextlib.suppress(OSError):
                    folder.rmdir()
                    break
                if time.monotonic() > deadline:
                    break  # swept up by a later grading
                time.sleep(0.005)
        self.folders = []


def make(memory_bytes: int, processes: int) -> Group:
    """Return a group with these limits for all its processes together; an empty one where none can be made."""
    hierarchy = find()
    group = Group()
    if hierarchy is None:
        return group
    name = f"{_PREFIX}.{os.getpid()}.{next(_NUMBERS)}"
    limits = {
        # Version 1, then version 2. Swap would let a memory bomb slow down the machine instead of ending.
        "memory": (("memory.limit_in_bytes", memory_bytes), ("memory.memsw.limit_in_bytes", memory_bytes),
                   ("memory.max", memory_bytes), ("memory.swap.max", 0)),
        "pids": (("pids.max", processes),),
    }  # fmt: skip
    try:
        for controller, folder in hierarchy.folders.items():
            own = folder / name
            if own not in group.folders:
                own.mkdir()
                group.folders.append(own)
            for file, value in limits[controller]:
                if (own / file).exists():
                    (own / file).write_text(str(value))
    except OSError:
        group.close()
    return group


@cache
def find(root: Path = ROOT) -> Hierarchy | None:
    """Return where groups with limits on memory and processes can be made, None if nowhere. Changes nothing to stay.

    Leftovers of gradings that were killed are taken away on the way.
    """
    own = dict(re.findall(r"^\d+:([^:]*):(.*)$", _read(Path("/proc/self/cgroup")), re.MULTILINE))
    if (root / "cgroup.controllers").exists():
        folder = _version_2(root / own.get("", "/").lstrip("/"))
        hierarchy = Hierarchy(2, {"memory": folder, "pids": folder}) if folder else None
    else:
        folders = {name: root / name / own.get(name, "/").lstrip("/") for name in ("memory", "pids")}
        hierarchy = Hierarchy(1, folders) if all(_usable(folder) for folder in folders.values()) else None
    if hierarchy is not None:
        for folder in set(hierarchy.folders.values()):
            _sweep(folder)
        _post_guard(set(hierarchy.folders.values()))
    return hierarchy


def _post_guard(folders: set[Path]) -> None:
    """Start a process that ends what is left in this grader's groups when the grader has been killed.

    bubblewrap, killed while it builds a wall, leaves its half-built child waiting for ever. Nothing of a submission
    runs in it, but nobody else would end it before the next grading.
    """
    patterns = [f'"{folder}"/{_PREFIX}.{os.getpid()}.*' for folder in folders]
    script = _GUARD.replace("GROUPS", " ".join(patterns))
    read_end, _write_end = os.pipe()  # the writing end is open as long as this process lives, and nobody inherits it
    quiet = [(os.POSIX_SPAWN_OPEN, stream, os.devnull, os.O_WRONLY, 0) for stream in (1, 2)]
    os.posix_spawn(
        "/bin/sh", ["sh", "-c", script], {"PATH": os.environ.get("PATH", os.defpath)},
        file_actions=[(os.POSIX_SPAWN_DUP2, read_end, 0), *quiet], setsid=True,
    )  # fmt: skip
    os.close(read_end)


def _version_2(own: Path) -> Path | None:
    """Return the folder below which limited groups can be made.

    Version 2 lets a group have either processes or limited groups below it. So we move aside, into a group beside the
    walls', which a delegated folder allows (`systemd-run --user --scope -p Delegate=yes`).
    """
    # A grader that another one of ours has started sits in that one's group beside the walls'.
    folder = own.parent if own.name.startswith(f"{_PREFIX}-self") else own
    try:
        if not {"memory", "pids"} <= set(_read(folder / "cgroup.subtree_control").split()):
            if folder == own:
                aside = own / f"{_PREFIX}-self.{os.getpid()}"
                aside.mkdir(exist_ok=True)
                for pid in _read(own / "cgroup.procs").split():
                    with contextlib.suppress(ProcessLookupError):
                        (aside / "cgroup.procs").write_text(pid)
            (folder / "cgroup.subtree_control").write_text("+memory +pids")
    except OSError:
        return None
    return folder if _usable(folder) else None


def _usable(folder: Path) -> bool:
    probe = folder / f"{_PREFIX}.{os.getpid()}.probe"
    try:
        probe.mkdir()
        probe.rmdir()
    except OSError:
        return False
    return True


def _sweep(folder: Path) -> None:
    """Take away the groups of gradings that are no more, with what is left in them."""
    for left in folder.glob(f"{_PREFIX}*.*"):
        pid = left.name.split(".")[1]
        if pid.isdigit() and not Path("/proc", pid).exists():
            # bubblewrap, killed at the wrong moment, can leave its half-built child waiting; nobody else would end it.
            for member in _read(left / "cgroup.procs").split() if "-self" not in left.name else ():
                with contextlib.suppress(OSError):
                    os.kill(int(member), signal.SIGKILL)
            with contextlib.suppress(OSError):
                left.rmdir()


def _full(folder: Path) -> bool:
    """Return whether a group has come to its own limit on memory."""
    # Version 1 counts failures too, but not on every kernel; its peak is told everywhere.
    limit = _number(folder / "memory.limit_in_bytes", r"^(\d+)")
    peak = _number(folder / "memory.max_usage_in_bytes", r"^(\d+)")
    return _number(folder / "memory.events", r"^max (\d+)") > 0 or (limit > 0 and peak > 0.95 * limit)


def _number(path: Path, pattern: str) -> int:
    match = re.search(pattern, _read(path), re.MULTILINE)
    return int(match[1]) if match else 0


def _read(path: Path) -> str:
    try:
        return path.read_text()
    except OSError:
        return ""
