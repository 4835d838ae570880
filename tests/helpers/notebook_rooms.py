"""Folders for notebooks that run beside each other: no two of them hear one another."""

from __future__ import annotations

import shutil
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from grader.notebook.workspace import Workspace

_LOCK = threading.Lock()
_TAKEN: set[int] = set()


@contextmanager
def room(parent: Path | None = None) -> Iterator[Path]:
    """Give a folder, gone in the end, whose `ws` has a DDS domain of its own among all rooms that are open.

    A workspace's domain comes from its path and is one of a hundred: of two by chance, one pair in a hundred would find
    the other's nodes in its lists.
    """
    folder, domain = _enter(parent)
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)
        with _LOCK:
            _TAKEN.discard(domain)


def _enter(parent: Path | None) -> tuple[Path, int]:
    while True:
        folder = Path(tempfile.mkdtemp(prefix="room-", dir=parent)).resolve()
        domain = Workspace(folder / "ws").domain_id
        with _LOCK:
            if domain not in _TAKEN:
                _TAKEN.add(domain)
                return folder, domain
        folder.rmdir()
