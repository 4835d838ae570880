"""Recognise the files of a package that the course laid out and that are unchanged. Trusts nothing in the marker.

`start_at` in a notebook writes the marker. A student can delete it, so its absence proves nothing.
"""

from __future__ import annotations

import hashlib
import json
from pathlib import Path, PurePosixPath

from grader.words import say_count, some

MARKER = ".course.json"
MAX_BYTES = 64 * 1024
MAX_FILES = 500
_MAX_SHOWN = 12


def note(package: Path) -> str:
    """Return a sentence that names the files laid out by the course; "" if there are none, or no marker."""
    found = unchanged(package)
    if not found:
        return ""
    return say_count(
        "{n} file was laid out by the course (start_at) and not changed since, so not the student's own work: {names}.",
        "{n} files were laid out by the course (start_at) and not changed since, so not the student's own work: "
        "{names}.",
        len(found),
        names=some(found, _MAX_SHOWN),
    )


def unchanged(package: Path) -> list[str]:
    """Return the paths of the files whose content still matches the marker's checksum."""
    marker = package / MARKER
    try:
        if marker.is_symlink() or marker.stat().st_size > MAX_BYTES:
            return []
        sums = json.loads(marker.read_text(encoding="utf-8"))["sha256"]
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return []
    if not isinstance(sums, dict) or len(sums) > MAX_FILES:
        return []
    return [name for name, digest in sums.items() if isinstance(digest, str) and _digest(package, name) == digest]


def _digest(package: Path, name: str) -> str | None:
    path = PurePosixPath(name)
    if path.is_absolute() or ".." in path.parts:
        return None
    try:
        # A submission that was taken in has only regular files.
        return hashlib.sha256((package / path).read_bytes()).hexdigest()
    except (OSError, ValueError):
        return None
