"""Folders for the time of a grading, which a later grading clears away if nobody else could."""

from __future__ import annotations

import contextlib
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def folder(name: str) -> Iterator[Path]:
    """Give a new folder of our own below the system's temporary folder, and take it away afterwards.

    Folders of the same name whose process is no more are taken away first: a grader that is killed clears nothing.
    """
    parent = Path(tempfile.gettempdir())
    sweep(parent, name)
    made = Path(tempfile.mkdtemp(prefix=f"{name}-{os.getpid()}-", dir=parent))
    try:
        yield made
    finally:
        shutil.rmtree(made, ignore_errors=True)


def sweep(parent: Path, name: str) -> None:
    """Take away the folders "NAME-PID-..." in `parent` whose process is no more."""
    for left in parent.glob(f"{name}-*-*"):
        pid = left.name[len(name) + 1 :].partition("-")[0]
        if pid.isdigit() and not Path("/proc", pid).exists():
            with contextlib.suppress(OSError):
                shutil.rmtree(left, ignore_errors=True)
