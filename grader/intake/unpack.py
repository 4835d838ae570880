"""Copy what a plan keeps into a fresh folder: regular files only, and never outside it."""

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
from grader.evidence import Flag
from grader.intake.containers import Folder, Kind, Readable, open_container
from grader.intake.plan import Limits, plan
from grader.sanitize import printable

BLOCK = 256 * 1024


@dataclass(frozen=True)
class Unpacked:
    """What came of one container: remarks, and what is left of the limits for archives inside."""

    flags: tuple[Flag, ...]
    notes: tuple[str, ...]
    left: Limits


def unpack(source: Path, into: Path, limits: Limits) -> Unpacked:
    """Copy the files of the folder or archive `source` into the empty folder `into`; return what was met.

    Raises:
        SubmissionError: it cannot be opened, is damaged, or is more than `limits` allow.
        GraderError: `into` cannot be written, or `source` cannot be read.
    """
    container = open_container(source)
    packed_bytes = None if isinstance(container, Folder) else source.stat().st_size
    if isinstance(container, Folder):
        container = container.without(into)
    entries = container.entries()
    decided = plan(container.name, entries, limits, packed_bytes)
    with _our_disk(into):
        into.mkdir(parents=True, exist_ok=True)
    stated = {entry.index: entry.size for entry in entries if entry.kind is Kind.FILE}
    for index, stream in container.contents(decided.files.keys()):
        path = decided.files[index]
        written = _write(into / path, stream, stated[index], path in decided.executable)
        if written != stated[index]:
            raise SubmissionError(
                f"{printable(path)} in {printable(container.name)} is not as long as stated: the archive is damaged, "
                "or the folder changed meanwhile. Pack it again."
            )
    with _our_disk(into):
        for path, original in decided.copies.items():
            (into / path).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(into / original, into / path, follow_symlinks=False)
    left = replace(
        limits,
        total_bytes=limits.total_bytes - decided.bytes,
        files=limits.files - len(decided.files) - len(decided.copies),
    )
    return Unpacked(decided.flags, decided.notes, left)


def _write(path: Path, stream: Readable, most: int, executable: bool) -> int:
    """Write `stream` to the new file `path`; stop one byte after `most`. Return the bytes read."""
    with _our_disk(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW, 0o755 if executable else 0o644)
    done = 0
    with os.fdopen(handle, "wb") as file:
        while done <= most and (block := stream.read(min(BLOCK, most + 1 - done) or 1)):
            done += len(block)
            with _our_disk(path):
                file.write(block)
    return done


@contextmanager
def _our_disk(path: Path) -> Iterator[None]:
    """Turn what goes wrong with our own disk into a GraderError."""
    try:
        yield
    except OSError as error:
        hint = "Free some space" if error.errno in (errno.ENOSPC, errno.EDQUOT) else "Choose another --out"
        raise GraderError(f"Cannot write {printable(str(path))}: {error.strerror}. {hint} and grade again.") from error


def content_hash(folder: Path, files: list[str]) -> str:
    """Return the sha256 over the sorted paths and bytes of `files`: the same for every way of packing them."""
    total = hashlib.sha256()
    for path in sorted(files):
        data = (folder / path).read_bytes()
        total.update(f"{len(path.encode())}:{path}:{len(data)}:".encode())
        total.update(data)
    return total.hexdigest()
