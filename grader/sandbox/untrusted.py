"""Read files that a submission may have made: plain files only, no link followed, never more than a limit."""

from __future__ import annotations

import codecs
import io
import os
import re
import stat
import tokenize
from pathlib import Path
from typing import BinaryIO


def text(path: Path, cap: int = 5_000_000) -> str | None:
    """Return the text of a file that a submission may have made; None if it is no plain file, or longer than `cap`."""
    try:
        with opened(path) as stream:
            if os.fstat(stream.fileno()).st_size > cap:
                return None
            return stream.read(cap).decode("utf-8", "surrogateescape")
    except OSError:
        return None


_MOST_PYTHON = 5_000_000


# The encodings in which people write. Others can hide code, or take hours to be read.
_ENCODINGS = re.compile(r"utf-8(-sig)?|ascii|iso8859-\d+|cp\d+|mac-\w+|koi8-\w|gbk?|gb\w+|big5\w*|shift_jis\w*|euc_\w+")


_COOKIE = re.compile(r"^([ \t\f]*#.*?coding[:=][ \t]*)[-\w.]+", re.ASCII)


def python(path: Path) -> str | None:
    """Return a Python source as Python reads it, so that it can be written as UTF-8 and still be the same module.

    The encoding that it declares is undone and a byte order mark taken away, lines end as on Linux, and no form
    feed stands in the indentation. None if it is no plain file, too long, or in no encoding in which people write.
    """
    try:
        with opened(path) as stream:
            if os.fstat(stream.fileno()).st_size > _MOST_PYTHON:
                return None
            data = stream.read(_MOST_PYTHON).replace(b"\r\n", b"\n").replace(b"\r", b"\n")
        declared, _ = tokenize.detect_encoding(io.BytesIO(data).readline)
        encoding = codecs.lookup(declared).name
        if not _ENCODINGS.fullmatch(encoding):
            return None
        lines = data.decode(encoding).split("\n")
    except (OSError, SyntaxError, ValueError, LookupError):
        return None
    lines[:2] = [_COOKIE.sub(r"\1utf-8", line) for line in lines[:2]]
    return "\n".join(line[1 + indent :] if (indent := _last_form_feed(line)) >= 0 else line for line in lines)


def _last_form_feed(line: str) -> int:
    """Return where the last form feed in a line's indentation stands, -1 if there is none: Python counts on from it."""
    return line.rfind("\f", 0, len(line) - len(line.lstrip(" \t\f"))) if "\f" in line else -1


def opened(path: Path) -> BinaryIO:
    """Open a plain file for reading, following no link and waiting for nobody who writes into a pipe of its name.

    Raises:
        OSError: there is none.
    """
    stream = os.fdopen(os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK), "rb")
    if not stat.S_ISREG(os.fstat(stream.fileno()).st_mode):
        stream.close()
        raise OSError(f"{path} is no plain file")
    return stream
