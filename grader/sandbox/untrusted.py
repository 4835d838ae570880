"""Read files that a submission may have written: regular files only, no link followed, never more than a size limit."""

from __future__ import annotations

import codecs
import io
import json
import os
import re
import stat
import tokenize
from pathlib import Path
from typing import Any, BinaryIO

MAX_BYTES = 5_000_000

# The encodings in which people write. Others can hide code, or take hours to decode.
_ENCODINGS = re.compile(r"utf-8(-sig)?|ascii|iso8859-\d+|cp\d+|mac-\w+|koi8-\w|gbk?|gb\w+|big5\w*|shift_jis\w*|euc_\w+")
_CODING_COOKIE = re.compile(r"^([ \t\f]*#.*?coding[:=][ \t]*)[-\w.]+", re.ASCII)


def open_file(path: Path) -> BinaryIO:
    """Open a regular file for reading. Follows no link, and never waits for the other end of a pipe.

    Raises:
        OSError: there is no regular file at `path`.
    """
    stream = os.fdopen(os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK), "rb")
    if not stat.S_ISREG(os.fstat(stream.fileno()).st_mode):
        stream.close()
        raise OSError(f"{path} is not a regular file")
    return stream


def read_bytes(path: Path, max_bytes: int = MAX_BYTES) -> bytes | None:
    """Return a file's content; None if it is not a regular file, cannot be read or is longer than `max_bytes`."""
    try:
        with open_file(path) as stream:
            return stream.read(max_bytes) if os.fstat(stream.fileno()).st_size <= max_bytes else None
    except (OSError, ValueError):
        return None


def read_text(
    path: Path, max_bytes: int = MAX_BYTES, *, errors: str = "surrogateescape", newline: str | None = ""
) -> str | None:
    """Return a file's text, read as UTF-8; None as for `read_bytes`. `errors` and `newline` are those of `open`."""
    data = read_bytes(path, max_bytes)
    return None if data is None else io.TextIOWrapper(io.BytesIO(data), "utf-8", errors, newline).read()


def read_json(path: Path, max_bytes: int = MAX_BYTES) -> Any:
    """Return a JSON file's value; None as for `read_bytes`, and if the file is not valid JSON or too deeply nested."""
    try:
        return json.loads(read_text(path, max_bytes) or "")
    except (ValueError, RecursionError):
        return None


def read_python(path: Path) -> str | None:
    """Return a Python source such that, written as UTF-8, it is still the same module.

    The declared encoding is undone and its declaration changed, a byte order mark is dropped, lines end as on Linux,
    and no form feed remains in the indentation. None as for `read_bytes`, and if people do not write in the encoding.
    """
    data = read_bytes(path)
    if data is None:
        return None
    data = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    try:
        declared, _ = tokenize.detect_encoding(io.BytesIO(data).readline)
        encoding = codecs.lookup(declared).name
        if not _ENCODINGS.fullmatch(encoding):
            return None
        lines = data.decode(encoding).split("\n")
    except (SyntaxError, ValueError, LookupError):
        return None
    lines[:2] = [_CODING_COOKIE.sub(r"\1utf-8", line) for line in lines[:2]]
    return "\n".join(line[1 + indent :] if (indent := _last_form_feed(line)) >= 0 else line for line in lines)


def _last_form_feed(line: str) -> int:
    """Return the index of the last form feed in a line's indentation, or -1: Python restarts its column count there."""
    return line.rfind("\f", 0, len(line) - len(line.lstrip(" \t\f"))) if "\f" in line else -1
