"""Write a file, or the contents of a folder, whole or not at all."""

from __future__ import annotations

import contextlib
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

_FRESH = ".results-"


def write_atomically(path: Path, text: str) -> None:
    """Put `text` into `path`, UTF-8, by way of a file beside it: a reader sees the old or the new one, never half.

    Raises:
        OSError: the folder cannot be written.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    descriptor, name = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
    beside = Path(name)
    try:
        with os.fdopen(descriptor, "w", encoding="utf-8") as stream:
            stream.write(text)
        beside.chmod(0o644)  # mkstemp makes private files; a report is to be read, by a web server too
        beside.replace(path)
    except BaseException:
        beside.unlink(missing_ok=True)
        raise


@contextmanager
def folder(out: Path) -> Iterator[Path]:
    """Yield an empty folder to write into. In the end its entries replace those of `out`, all of them or none.

    Raises:
        OSError: `out` cannot be written.
    """
    existed = out.exists()
    out.mkdir(parents=True, exist_ok=True)
    for left in (*out.glob(f"{_FRESH}*"), *out.glob(".report.*")):  # by a grader that was killed
        shutil.rmtree(left) if left.is_dir() else left.unlink()
    fresh = Path(tempfile.mkdtemp(prefix=_FRESH, dir=out))
    try:
        yield fresh
        # Everything is on the disk by now; moving it needs no space.
        for entry in sorted(fresh.iterdir()):
            if (out / entry.name).is_dir():
                (out / entry.name).rename(fresh / f"old-{entry.name}")
            entry.rename(out / entry.name)
    finally:
        shutil.rmtree(fresh, ignore_errors=True)
        if not existed:
            with contextlib.suppress(OSError):  # it is empty where nothing was graded
                out.rmdir()
