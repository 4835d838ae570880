"""Results kept by what decides them, so that nothing is run again that would run just the same."""

from __future__ import annotations

import contextlib
import datetime as dt
import gzip
import hashlib
import os
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from grader.evidence.store import from_json, to_json

T = TypeVar("T")

KEPT_DAYS = 7.0


@dataclass(frozen=True)
class Kept:
    """Facts in a folder, one file each, found again by a hash of everything that decides them.

    Attributes:
        folder: where they are; None keeps nothing and finds nothing.
        common: what decides all of them, such as the kit's code and the seed.
        fresh: find nothing, so that everything is collected anew and then kept.
    """

    folder: Path | None = None
    common: tuple[str, ...] = ()
    fresh: bool = False

    def find(self, kind: type[T], *decided_by: str) -> tuple[T, str] | None:
        """Return a fact and the local time at which it was collected, None if it is not there or damaged."""
        if self.folder is not None and not self.fresh:
            path = self._path(decided_by)
            with contextlib.suppress(OSError, EOFError, ValueError):
                fact = from_json(gzip.decompress(path.read_bytes()).decode(), kind)
                return fact, dt.datetime.fromtimestamp(path.stat().st_mtime).isoformat(" ", "minutes")
        return None

    def keep(self, fact: object, *decided_by: str) -> None:
        """Keep a fact. Without space on the disk it is not kept, and nothing else happens."""
        if self.folder is None:
            return
        with contextlib.suppress(OSError):
            self.folder.mkdir(parents=True, exist_ok=True)
            descriptor, part = tempfile.mkstemp(dir=self.folder, suffix=".part")
            try:
                with os.fdopen(descriptor, "wb") as stream:
                    stream.write(gzip.compress(to_json(fact).encode(), compresslevel=3))
                Path(part).replace(self._path(decided_by))
            finally:
                Path(part).unlink(missing_ok=True)

    def _path(self, decided_by: tuple[str, ...]) -> Path:
        assert self.folder is not None
        digest = hashlib.sha256("\0".join((*self.common, *decided_by)).encode("utf-8", "surrogateescape"))
        return self.folder / f"{digest.hexdigest()[:40]}.json.gz"


NOTHING_KEPT = Kept()


def forget_old(folder: Path, days: float = KEPT_DAYS) -> None:
    """Remove what was kept longer ago than `days`."""
    before = time.time() - days * 86400
    for path in folder.glob("*.*"):
        with contextlib.suppress(OSError):  # another grading has just removed it
            if path.stat().st_mtime < before:
                path.unlink()
