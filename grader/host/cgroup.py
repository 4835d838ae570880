"""Limit the memory and the number of processes of a whole sandbox with cgroups: version 2 where delegated, 1 as root.

A resource limit counts each process by itself, and root has no limit on the number of processes at all. A cgroup counts
everything in one sandbox together, including shared memory and files in memory. Where no cgroup can be made, resource
limits are used instead; `grader doctor` reports which.
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
# Waits for its standard input to close, which happens when the grader ends, and kills what is left in the grader's
# groups. Repeatedly: a process that was being started at that moment joins its group a little later.
_WATCHDOG = """
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
    """Where groups can be made: below one folder (version 2), or below one folder for each controller (version 1)."""

    version: int
    folders: Mapping[str, Path]


@dataclass
class Group:
    """The cgroup of one sandbox. Without folders it limits nothing, and resource limits must do."""

    folders: list[Path] = field(default_factory=list)

    @property
    def procs_files(self) -> list[str]:
        """Return the files into which a process writes its id to join the group."""
        return [str(folder / "cgroup.procs") for folder in self.folders]

    def limit_hit(self) -> str:
        """Return the limit that the group has hit: "memory", "processes" or "".

        HOST_MEMORY if a process was killed although the group was below its limit: the machine, or a group around this
        one, was out of memory.
        """
        for folder in self.folders:
            if _number(folder / "pids.events", r"^max (\d+)") > 0:
                return "processes"
            killed = _number(folder / "memory.events", r"^oom_kill (\d+)")
            killed += _number(folder / "memory.oom_control", r"^oom_kill (\d+)")
            if killed:
                return "memory" if _reached_memory_limit(folder) else HOST_MEMORY
        return ""

    def close(self) -> None:
        """Remove the group. Its processes are dead by now, but the kernel may take a moment to notice."""
        deadline = time.monotonic() + 2.0
        for folder in self.folders:
            while folder.exists():
                with contextlib.suppress(OSError):
                    folder.rmdir()
                    break
                if time.monotonic() > deadline:
                    break  # a later grading removes it
                time.sleep(0.005)
        self.folders = []


def create(memory_bytes: int, processes: int) -> Group:
    """Return a group with these limits for all its processes together; one without folders where none can be made."""
    hierarchy = find_hierarchy()
    group = Group()
    if hierarchy is None:
        return group
    name = f"{_PREFIX}.{os.getpid()}.{next(_NUMBERS)}"
    limits = {
        # Version 1, then version 2. With swap, a memory bomb would slow the machine down instead of being killed.
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
def find_hierarchy(root: Path = ROOT) -> Hierarchy | None:
    """Return where groups with limits on memory and processes can be made, None if nowhere.

    Also removes what killed gradings have left, and starts this grader's own watchdog.
    """
    hierarchy = _hierarchy(root)
    if hierarchy is not None:
        _sweep(hierarchy)
        _start_watchdog(set(hierarchy.folders.values()))
    return hierarchy


def sweep() -> None:
    """Remove the groups of graders that have ended, and kill what is left in them."""
    if (hierarchy := _hierarchy(ROOT)) is not None:
        _sweep(hierarchy)


def _hierarchy(root: Path) -> Hierarchy | None:
    own = dict(re.findall(r"^\d+:([^:]*):(.*)$", _read(Path("/proc/self/cgroup")), re.MULTILINE))
    if (root / "cgroup.controllers").exists():
        folder = _version_2(root / own.get("", "/").lstrip("/"))
        return Hierarchy(2, {"memory": folder, "pids": folder}) if folder else None
    folders = {name: root / name / own.get(name, "/").lstrip("/") for name in ("memory", "pids")}
    return Hierarchy(1, folders) if all(_usable(folder) for folder in folders.values()) else None


def _start_watchdog(folders: set[Path]) -> None:
    """Start a process that kills what is left in this grader's groups once the grader has been killed.

    If bubblewrap is killed while it sets up a sandbox, its child waits for ever. It runs no code of a submission, but
    without the watchdog it would live until the next grading.
    """
    patterns = [f'"{folder}"/{_PREFIX}.{os.getpid()}.*' for folder in folders]
    script = _WATCHDOG.replace("GROUPS", " ".join(patterns))
    read_end, _write_end = os.pipe()  # the write end stays open as long as this process lives; no child inherits it
    quiet = [(os.POSIX_SPAWN_OPEN, stream, os.devnull, os.O_WRONLY, 0) for stream in (1, 2)]
    os.posix_spawn(
        "/bin/sh", ["sh", "-c", script], {"PATH": os.environ.get("PATH", os.defpath)},
        file_actions=[(os.POSIX_SPAWN_DUP2, read_end, 0), *quiet], setsid=True,
    )  # fmt: skip
    os.close(read_end)


def _version_2(own: Path) -> Path | None:
    """Return the folder below which limited groups can be made.

    In version 2 a group has either processes or limited groups below it. So the grader moves into a group beside those
    of the sandboxes, which a delegated folder allows (`systemd-run --user --scope -p Delegate=yes`).
    """
    # A grader that was started by another grader is already in such a group.
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


def _sweep(hierarchy: Hierarchy) -> None:
    for left in [left for folder in set(hierarchy.folders.values()) for left in folder.glob(f"{_PREFIX}*.*")]:
        pid = left.name.split(".")[1]
        if pid.isdigit() and not Path("/proc", pid).exists():
            # If bubblewrap is killed at the wrong moment, its child waits for ever; nothing else would end it.
            for member in _read(left / "cgroup.procs").split() if "-self" not in left.name else ():
                with contextlib.suppress(OSError):
                    os.kill(int(member), signal.SIGKILL)
            with contextlib.suppress(OSError):
                left.rmdir()


def _reached_memory_limit(folder: Path) -> bool:
    """Return whether a group has reached its own limit on memory."""
    # Version 1 counts failures too, but not on every kernel; every kernel reports the peak.
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
