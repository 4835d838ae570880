"""What the cache of builds holds, and removing what has long not been used, while gradings use the rest, too."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterator
from contextlib import ExitStack
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

    @property
    def is_empty(self) -> bool:
        """Return whether nothing is left of it but locks."""
        return all(path.suffix in (LOCK, USE) for path in self.paths)


@dataclass(frozen=True)
class Store:
    """One kind of entries."""

    title: str
    entries: tuple[Entry, ...]

    @property
    def bytes(self) -> int:
        """Return the space that it takes on the disk."""
        return sum(entry.bytes for entry in self.entries)


@dataclass(frozen=True)
class Pruned:
    """What was removed, by kind, and how many entries stayed because a grading uses them."""

    removed: tuple[Store, ...]
    in_use: int


def stores(cache: Path) -> tuple[Store, ...]:
    """Return what the cache holds."""
    return tuple(
        Store(title, tuple(entry for entry in _entries(cache / name) if not entry.is_empty))
        for name, title in _STORES.items()
    )


def prune(cache: Path, older_than_days: float) -> Pruned:
    """Remove what has not been used for so many days, and what killed gradings have left."""
    before = time.time() - older_than_days * _DAY_S
    in_use = 0
    gone: dict[str, list[Entry]] = {name: [] for name in _STORES}
    remove_abandoned(cache)
    for name in ("builds", "trees", "hashes", "evidence"):
        for entry in _entries(cache / name):
            if entry.used <= before:
                try:
                    _remove(entry, cache / name)
                    gone[name] += [] if entry.is_empty else [entry]
                except BlockingIOError:
                    in_use += 1
    # The compiler cache is read only by builds; without any, nobody has used it for as long as them.
    if not list(_entries(cache / "builds")):
        for entry in _entries(cache / "ccache"):
            if entry.used <= before:
                tempdir.remove(cache / "ccache")
                gone["ccache"].append(entry)
    return Pruned(tuple(Store(_STORES[name], tuple(entries)) for name, entries in gone.items()), in_use)


def remove_abandoned(cache: Path) -> None:
    """Remove what gradings that were killed while they built have left."""
    for left in (cache / "builds").glob("*.work"):
        with (
            contextlib.suppress(BlockingIOError),  # it is being built now
            locked(left.parent / (left.name.partition(".")[0] + LOCK), wait=False),
        ):
            tempdir.remove(left)


def _entries(folder: Path) -> Iterator[Entry]:
    """Yield the entries in a folder, the longest unused first."""
    if folder.name == "ccache":
        groups = {"": [folder]} if folder.is_dir() else {}
    else:
        groups = dict[str, list[Path]]()
        for path in folder.iterdir() if folder.is_dir() else ():
            groups.setdefault(path.name.partition(".")[0], []).append(path)
    found = [_entry(key, paths) for key, paths in groups.items()]
    yield from sorted(found, key=lambda entry: entry.used)


def _entry(key: str, paths: list[Path]) -> Entry:
    size, times = 0, [0.0]
    for path in paths:
        for each in (path, *path.rglob("*")) if path.is_dir() and not path.is_symlink() else (path,):
            with contextlib.suppress(OSError):  # it has just been removed
                size += each.lstat().st_blocks * 512
        with contextlib.suppress(OSError):
            # A lock is also touched by looking at it.
            times += [path.lstat().st_mtime] if path.suffix != LOCK else []
    return Entry(key, tuple(paths), size, max(times))


def _remove(entry: Entry, folder: Path) -> None:
    """Remove an entry.

    Raises:
        BlockingIOError: somebody makes or uses it.
    """
    with ExitStack() as stack:
        held = [folder / f"{entry.key}{suffix}" for suffix in (LOCK, USE)]
        for path in held:
            stack.enter_context(locked(path, wait=False))
        for path in (*entry.paths, *held):
            if path.is_dir() and not path.is_symlink():
                tempdir.remove(path)
            else:
                with contextlib.suppress(FileNotFoundError):
                    path.unlink()
