"""Folders for notebooks that run at the same time and must not find each other's nodes."""

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
def isolated_folder(parent: Path | None = None) -> Iterator[Path]:
    """Yield a temporary folder whose workspace `ws` has a DDS domain that no other open folder has.

    A workspace's domain is derived from its path and is one of a hundred, so two random paths share one in a hundred
    times.
    """
    folder, domain = _take(parent)
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)
        with _LOCK:
            _TAKEN.discard(domain)


def _take(parent: Path | None) -> tuple[Path, int]:
    while True:
        folder = Path(tempfile.mkdtemp(prefix="notebook-", dir=parent)).resolve()
        domain = Workspace(folder / "ws").domain_id
        with _LOCK:
            if domain not in _TAKEN:
                _TAKEN.add(domain)
                return folder, domain
        folder.rmdir()
