"""Write a zip archive whose bytes depend on its files alone."""

from __future__ import annotations

import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from grader.errors import GraderError
from grader.words import say

_EPOCH = (1980, 1, 1, 0, 0, 0)


class Entry(NamedTuple):
    """A file of an archive."""

    content: bytes
    executable: bool


def write_zip(target: Path, entries: Mapping[str, Entry], date: tuple[int, int, int, int, int, int] = _EPOCH) -> None:
    """Write the zip `target`, completely or not at all. All its files have the same date and time.

    Raises:
        GraderError: it cannot be written.
    """
    part = target.with_name(target.name + ".part")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with zipfile.ZipFile(part, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
            for name, entry in entries.items():
                info = zipfile.ZipInfo(name, date)
                info.compress_type = zipfile.ZIP_DEFLATED
                info.external_attr = (0o100755 if entry.executable else 0o100644) << 16
                archive.writestr(info, entry.content)
        part.replace(target)
    except OSError as error:
        raise GraderError(
            say("Cannot write {target}: {error}. Choose another --out.", target=target, error=error)
        ) from error
    finally:
        part.unlink(missing_ok=True)
