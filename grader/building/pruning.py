"""What the cache of builds holds, and removing what has long not been used, while gradings use the rest, too."""

from __future__ import annotations

import contextlib
import time
from dataclasses import dataclass
from pathlib import Path

from grader.building.cache import LOCK, USE, locked
from grader.host import tempdir

_STORES = {
    "builds": "builds",
    "trees": "build trees",
    "hashes": "type hashes",
    "ccache": "compiler cache",
    "evidence": "evidence",
}
_DAY_S = 86400.0


@dataclass(frozen=True)
class Entry:
    """All files of one entry: the result with its lock and checksum. `used` is the time of the last use."""

    key: str
    paths: tuple[Path, ...]
    bytes: int
    used: float


Stores = dict[str, list[Entry]]
"""Entries by the title of their store, the longest unused first."""


def stores(cache: Path) -> Stores:
    """Return what the cache holds, without locks of which nothing else is left."""
    return {title: list(filter(_is_content, _entries(cache / name))) for name, title in _STORES.items()}


def prune(cache: Path, older_than_days: float) -> tuple[Stores, int]:
    """Remove what has not been used for so many days, and what killed gradings have left.

    Return what was removed, and how many entries stayed because a grading uses them.
    """
    before = time.time() - older_than_days * _DAY_S
    gone: Stores = {title: [] for title in _STORES.values()}
    in_use = 0
    remove_abandoned(cache)
    for name, title in _STORES.items():
        # The compiler cache is read only by builds; without any, nobody has used it for as long as them.
        if name == "ccache" and _entries(cache / "builds"):
            continue
        for entry in [entry for entry in _entries(cache / name) if entry.used <= before]:
            try:
                _remove(entry, cache / name)
                gone[title] += filter(_is_content, [entry])
            except BlockingIOError:
                in_use += 1
    return gone, in_use


def remove_abandoned(cache: Path) -> None:
    """Remove what gradings that were killed while they built have left."""
    for left in (cache / "builds").glob("*.work"):
        lock = left.with_name(left.name.partition(".")[0] + LOCK)
        with contextlib.suppress(BlockingIOError), locked(lock, wait=False):  # else it is being built now
            tempdir.remove(left)


def _is_content(entry: Entry) -> bool:
    return not all(path.suffix in (LOCK, USE) for path in entry.paths)


def _entries(folder: Path) -> list[Entry]:
    """Return the entries in a folder, the longest unused first; the compiler cache is one."""
    groups: dict[str, list[Path]] = {}
    for path in folder.iterdir() if folder.is_dir() else ():
        groups.setdefault("ccache" if folder.name == "ccache" else path.name.partition(".")[0], []).append(path)
    return sorted((_entry(key, group) for key, group in groups.items()), key=lambda entry: entry.used)


def _entry(key: str, paths: list[Path]) -> Entry:
    size, used = 0, 0.0
    for path in paths:
        with contextlib.suppress(OSError):  # it has just been removed; a lock is also touched by looking at it
            used = used if path.suffix == LOCK else max(used, path.lstat().st_mtime)
        for each in (path, *path.rglob("*")) if path.is_dir() and not path.is_symlink() else (path,):
            with contextlib.suppress(OSError):
                size += each.lstat().st_blocks * 512
    return Entry(key, tuple(paths), size, used)


def _remove(entry: Entry, folder: Path) -> None:
    """Remove an entry.

    Raises:
        BlockingIOError: somebody makes or uses it.
    """
    lock, use = (folder / f"{entry.key}{suffix}" for suffix in (LOCK, USE))
    with locked(lock, wait=False), locked(use, wait=False):
        for path in (*entry.paths, lock, use):
            if path.is_dir() and not path.is_symlink():
                tempdir.remove(path)
            else:
                path.unlink(missing_ok=True)
