"""Copy the files of a plan into a new folder: regular files only, and never outside it."""

from __future__ import annotations

import errno
import hashlib
import os
import shutil
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

from grader.errors import GraderError
from grader.intake.containers import Entry, Kind, Readable, SizeLimits, damaged, open_container, refused
from grader.intake.copy_plan import CopyPlan, plan_copy
from grader.sanitize import printable
from grader.words import mark, say

BLOCK = 256 * 1024


@dataclass(frozen=True)
class Unpacked:
    """The result of unpacking one container: the plan that was followed, and the limits left for archives inside."""

    plan: CopyPlan
    left: SizeLimits


def unpack(
    source: Path, into: Path, limits: SizeLimits, *, leave_out: Path | None = None, export: bool = False
) -> Unpacked:
    """Copy the files of the folder or archive `source` into the empty folder `into`.

    The folder `leave_out` inside `source` is not copied. `export` is as for `plan_copy`.

    Raises:
        SubmissionError: it cannot be opened, is damaged, or exceeds `limits`.
        GraderError: `into` cannot be written, or `source` cannot be read.
    """
    container = open_container(source, [into, *([leave_out] if leave_out else [])], limits)
    plan = plan_copy(container, limits, export=export)
    with _disk_errors(into):
        for folder in ("", *plan.folders):
            (into / folder).mkdir(parents=True, exist_ok=True)
    paths = {entry.index: path for path, entry in plan.files.items() if entry.kind is Kind.FILE}
    for index, stream in container.contents(paths.keys()):
        path, entry = paths[index], plan.files[paths[index]]
        if _write(into / path, stream, entry, container.name) != entry.size:
            words = mark(
                "{file} in {name} does not have its declared size: the archive is damaged, or the folder changed in "
                "the meantime."
            )
            raise refused(container.name, words, mark("Pack it again."), file=printable(path))
    with _disk_errors(into):
        for path, entry in plan.files.items():
            if entry.kind is Kind.HARD_LINK:
                (into / path).parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(into / entry.target, into / path, follow_symlinks=False)
    used = sum(entry.size for entry in plan.files.values())
    left = replace(limits, total_bytes=limits.total_bytes - used, files=limits.files - len(plan.files))
    return Unpacked(plan, left)


def _write(path: Path, stream: Readable, entry: Entry, name: str) -> int:
    """Write the `stream` of an entry of the container `name` to the new file `path`; return the number of bytes read.

    Stop one byte after the size of the entry.
    """
    done, mode = 0, 0o755 if entry.mode & stat.S_IXUSR else 0o644
    with _disk_errors(path):  # also as the file is closed, which writes the rest of it
        path.parent.mkdir(parents=True, exist_ok=True)
        handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW, mode)
        with os.fdopen(handle, "wb") as file:
            while done <= entry.size:
                with damaged(name):
                    block = stream.read(min(BLOCK, entry.size + 1 - done))
                if not block:
                    break
                done += len(block)
                file.write(block)
    return done


@contextmanager
def _disk_errors(path: Path) -> Iterator[None]:
    """Turn an OSError on the grader's own disk into a GraderError."""
    try:
        yield
    except OSError as error:
        full = error.errno in (errno.ENOSPC, errno.EDQUOT)
        raise GraderError(
            say("Cannot write {path}: {why}.", path=printable(str(path)), why=error.strerror),
            say("Free some space and grade again.") if full else say("Choose another --out and grade again."),
        ) from error


def content_hash(folder: Path, files: list[str]) -> str:
    """Return the SHA-256 over the sorted paths and bytes of `files`: the same however they were packed."""
    total = hashlib.sha256()
    for path in sorted(files):
        data = (folder / path).read_bytes()
        total.update(f"{len(path.encode())}:{path}:{len(data)}:".encode())
        total.update(data)
    return total.hexdigest()
