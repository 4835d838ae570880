"""Folders for the time of a grading, which a later grading clears away if nobody else could."""

from __future__ import annotations

import contextlib
import os
import shutil
import subprocess
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
        remove(made)


def remove(path: Path) -> None:
    """Take away a folder with all that is in it, however deep, and whatever its modes. Nothing is said of what stays.

    Python's own goes down by recursion, and gives up after a thousand folders in folders.
    """
    with contextlib.suppress(RecursionError):
        shutil.rmtree(path, ignore_errors=True)
    if path.is_dir():
        for command in (["chmod", "-R", "u+rwX"], ["rm", "-rf"]):
            subprocess.run([*command, "--", str(path)], capture_output=True, check=False)


def sweep(parent: Path, name: str) -> None:
    """Take away the folders "NAME-PID-..." in `parent` whose process is no more."""
    for left in parent.glob(f"{name}-*-*"):
        pid = left.name[len(name) + 1 :].partition("-")[0]
        if pid.isdigit() and not Path("/proc", pid).exists():
            remove(left)
