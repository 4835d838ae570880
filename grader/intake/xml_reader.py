"""Read XML of a submission as a stream: a size limit, no DOCTYPE (and so no entities), no tree in memory."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from xml.parsers import expat

from grader.sanitize import printable


class _DoctypeFound(Exception):
    """A document type, the way to entity expansion."""


def read_xml(
    path: Path,
    most_bytes: int,
    start: Callable[[str, dict[str, str]], None],
    end: Callable[[str], None] | None = None,
    text: Callable[[str], object] | None = None,
) -> str:
    """Feed the tags, attributes and text of a file to the callbacks; return why it cannot be read, "" if it can."""
    try:
        with path.open("rb") as stream:
            data = stream.read(most_bytes + 1)
    except OSError as error:
        return f"cannot be read: {error.strerror}"
    if len(data) > most_bytes:
        kilobytes = most_bytes // 1024
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
