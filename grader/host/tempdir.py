"""Temporary folders; a later grading removes those of a grader that was killed."""

from __future__ import annotations

import contextlib
import os
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


def parent() -> Path:
    """Return the system's temporary folder."""
    return Path(tempfile.gettempdir())


@contextmanager
def folder(name: str) -> Iterator[Path]:
    """Yield a new folder in the system's temporary folder and remove it afterwards.

    First removes folders of the same name whose process has ended: a grader that is killed cleans nothing up.
    """
    sweep(parent(), name)
    made = Path(tempfile.mkdtemp(prefix=f"{name}-{os.getpid()}-", dir=parent()))
    try:
        yield made
    finally:
        remove(made)


def remove(path: Path) -> None:
    """Remove a folder and its contents, however deep and whatever the modes. What cannot be removed is ignored.

    shutil.rmtree is recursive and gives up at a depth of about a thousand folders.
    """
    with contextlib.suppress(RecursionError):
        shutil.rmtree(path, ignore_errors=True)
    if path.is_dir():
        for command in (["chmod", "-R", "u+rwX"], ["rm", "-rf"]):
            subprocess.run([*command, "--", str(path)], capture_output=True, check=False)


def sweep(parent: Path, name: str) -> None:
    """Remove the folders "NAME-PID-..." in `parent` whose process has ended."""
    for left in parent.glob(f"{name}-*-*"):
        pid = left.name[len(name) + 1 :].partition("-")[0]
        if pid.isdigit() and not Path("/proc", pid).exists():
            remove(left)
