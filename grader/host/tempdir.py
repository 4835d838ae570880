"""Temporary folders, and files and folders that are replaced completely or not at all.

A later grading removes the folders of a grader that was killed.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import signal
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


_FRESH = ".results-"


def write_atomically(path: Path, text: str | bytes) -> None:
    """Write `text`, in UTF-8 if it is not bytes yet, to `path`.

    It goes by way of a file beside that: a reader sees the old file or the new one.

    Raises:
        OSError: the folder cannot be written.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    descriptor, name = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
    beside = Path(name)
    try:
        with os.fdopen(descriptor, "wb") as stream:
            stream.write(text.encode() if isinstance(text, str) else text)
        beside.chmod(0o644)  # mkstemp makes private files, but a web server must be able to read a report
        beside.replace(path)
    except BaseException:
        beside.unlink(missing_ok=True)
        raise


@contextmanager
def replace_entries(out: Path) -> Iterator[Path]:
    """Yield an empty folder to write to. At the end its entries replace those of the same name in `out`, all or none.

    Raises:
        OSError: `out` cannot be written.
    """
    existed = out.exists()
    out.mkdir(parents=True, exist_ok=True)
    remove_left(out)
    fresh = Path(tempfile.mkdtemp(prefix=_FRESH, dir=out))
    try:
        yield fresh
        # Everything is on the disk by now; moving takes no space.
        with not_interrupted():
            for entry in sorted(fresh.iterdir()):
                if (out / entry.name).is_dir():
                    (out / entry.name).rename(fresh / f"old-{entry.name}")
                entry.rename(out / entry.name)
    finally:
        remove_left(out, new=not existed)


def remove_left(out: Path, *, new: bool = False) -> None:
    """Remove what is left in `out` of results that did not get to their place, and a `new` folder if it is empty."""
    for left in (*out.glob(f"{_FRESH}*"), *out.glob(".report.*")):
        shutil.rmtree(left, ignore_errors=True) if left.is_dir() else left.unlink()
    if new:
        with contextlib.suppress(OSError):  # something was written
            out.rmdir()


@contextmanager
def not_interrupted() -> Iterator[None]:
    """Hold back Ctrl-C and SIGTERM, which would come between two files that belong together."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGTERM})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
