"""Tell which files of a package the course has laid out, unchanged since. Reads the marker; trusts nothing in it.

`start_at` in a notebook writes the marker. A student may take it away, so its absence says nothing.
"""

from __future__ import annotations

import hashlib
import json
from pathlib import Path, PurePosixPath

MARKER = ".course.json"
MOST_BYTES = 64 * 1024
MOST_FILES = 500
_SHOWN = 12


def note(package: Path) -> str:
    """Return a sentence that names the files laid out by the course, "" if there are none or no marker."""
    found = unchanged(package)
    if not found:
        return ""
    shown = ", ".join(found[:_SHOWN]) + (f" and {len(found) - _SHOWN} more" if len(found) > _SHOWN else "")
    count = "1 file was" if len(found) == 1 else f"{len(found)} files were"
    return f"{count} laid out by the course (start_at) and not changed since, so not the student's own work: {shown}."


def unchanged(package: Path) -> list[str]:
    """Return the paths of the files whose content is still what the marker says was laid out."""
    return [name for name, digest in _sums(package / MARKER).items() if _digest(package, name) == digest]


def _sums(marker: Path) -> dict[str, str]:
    try:
        if marker.is_symlink() or marker.stat().st_size > MOST_BYTES:
            return {}
        sums = json.loads(marker.read_text(encoding="utf-8"))["sha256"]
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return {}
    if not isinstance(sums, dict) or len(sums) > MOST_FILES:
        return {}
    return {name: digest for name, digest in sums.items() if isinstance(digest, str)}


def _digest(package: Path, name: str) -> str:
    path = PurePosixPath(name)
    if path.is_absolute() or ".." in path.parts:
        return ""
    try:
        # What was taken in holds regular files only.
        return hashlib.sha256((package / path).read_bytes()).hexdigest()
    except (OSError, ValueError):
        return ""
