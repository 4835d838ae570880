"""Copy the files of a plan into a new folder: regular files only, and never outside it."""

from __future__ import annotations

import errno
import hashlib
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

from grader.errors import GraderError, SubmissionError
from grader.intake.containers import Folder, Kind, SizeLimits, damaged, open_container
from grader.intake.copy_plan import CopyPlan, plan_copy
from grader.intake.streams import Readable
from grader.sanitize import printable
from grader.words import say

BLOCK = 256 * 1024


@dataclass(frozen=True)
class Unpacked:
    """The result of unpacking one container: the plan that was followed, and the limits left for archives inside."""

    plan: CopyPlan
    left: SizeLimits


def unpack(
    source: Path,
    into: Path,
    limits: SizeLimits,
    *,
    leave_out: Path | None = None,
    export: bool = False,
) -> Unpacked:
    """Copy the files of the folder or archive `source` into the empty folder `into`.

    The folder `leave_out` inside `source` is not copied. `export` is as for `plan_copy`.

    Raises:
        SubmissionError: it cannot be opened, is damaged, or exceeds `limits`.
        GraderError: `into` cannot be written, or `source` cannot be read.
    """
    container = open_container(source, [into, *([leave_out] if leave_out else [])], limits)
    packed_bytes = None if isinstance(container, Folder) else source.stat().st_size
    entries = container.entries()
    plan = plan_copy(container.name, entries, limits, packed_bytes, export=export)
    with _disk_errors(into):
        into.mkdir(parents=True, exist_ok=True)
        for folder in plan.folders:
            (into / folder).mkdir(parents=True, exist_ok=True)
    declared = {entry.index: entry.size for entry in entries if entry.kind is Kind.FILE}
    for index, stream in container.contents(plan.files.keys()):
        path = plan.files[index]
        written = _write(into / path, stream, declared[index], path in plan.executable, container.name)
        if written != declared[index]:
            raise SubmissionError(
                say(
                    "{file} in {name} does not have its declared size: the archive is damaged, or the folder changed "
                    "in the meantime.",
                    file=printable(path),
                    name=printable(container.name),
                ),
                say("Pack it again."),
            )
    with _disk_errors(into):
        for path, original in plan.copies.items():
            (into / path).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(into / original, into / path, follow_symlinks=False)
    left = replace(
        limits,
        total_bytes=limits.total_bytes - sum(plan.sizes.values()),
        files=limits.files - len(plan.sizes),
    )
    return Unpacked(plan, left)


def _write(path: Path, stream: Readable, max_bytes: int, executable: bool, name: str) -> int:
    """Write `stream`, of the container `name`, to the new file `path`; stop one byte after `max_bytes`.

    Return the number of bytes read.
    """
    done = 0
    with _disk_errors(path):  # also as the file is closed, which writes the rest of it
        path.parent.mkdir(parents=True, exist_ok=True)
        handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW, 0o755 if executable else 0o644)
        with os.fdopen(handle, "wb") as file:
            while done <= max_bytes:
                with damaged(name):
                    block = stream.read(min(BLOCK, max_bytes + 1 - done) or 1)
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
