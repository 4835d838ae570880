"""Read a submission's XML as a stream: with a size limit, and no DOCTYPE (so no entities), and no tree in memory."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from xml.parsers import expat

from grader.sanitize import printable


class _DoctypeFound(Exception):
    """A document type was declared, which allows entity expansion."""


def read_xml(
    path: Path,
    max_bytes: int,
    start: Callable[[str, dict[str, str]], None],
    end: Callable[[str], None] | None = None,
    text: Callable[[str], object] | None = None,
) -> str:
    """Feed the tags, attributes and text of a file to the callbacks; return why it cannot be read, or ""."""
    try:
        with path.open("rb") as stream:
            data = stream.read(max_bytes + 1)
    except OSError as error:
        return f"cannot be read: {error.strerror}"
    if len(data) > max_bytes:
        kilobytes = max_bytes // 1024
        return f"is larger than {f'{kilobytes // 1024} MB' if kilobytes >= 1024 else f'{kilobytes} KB'}"
    parser = expat.ParserCreate()
    parser.StartDoctypeDeclHandler = _refuse
    parser.StartElementHandler, parser.EndElementHandler, parser.CharacterDataHandler = start, end, text
    try:
        parser.Parse(data, True)
    except _DoctypeFound:
        return "declares a DOCTYPE, which is not allowed"
    except (expat.ExpatError, ValueError, LookupError) as error:
        # ValueError and LookupError: encodings that expat cannot read or that Python does not know.
        return f"is not XML: {printable(str(error))}"
    return ""


def _refuse(*_: object) -> None:
    raise _DoctypeFound
