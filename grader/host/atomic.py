"""Write a file whole or not at all."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path


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
