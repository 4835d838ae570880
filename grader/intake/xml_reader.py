"""Read a submission's XML: with a size limit, and without a DOCTYPE, so that no entity is expanded."""

from __future__ import annotations

from pathlib import Path
from typing import NoReturn
from xml.etree import ElementTree

from grader.sanitize import printable


class _DoctypeFound(Exception):
    """A document type was declared, which allows entity expansion."""


class _Builder(ElementTree.TreeBuilder):
    def doctype(self, *_: object) -> NoReturn:
        raise _DoctypeFound


def read_xml(path: Path, max_bytes: int) -> ElementTree.Element:
    """Return the root element of a file.

    Raises:
        ValueError: it cannot be read; the message is a predicate such as "is not XML: no element found".
    """
    try:
        with path.open("rb") as stream:
            data = stream.read(max_bytes + 1)
    except OSError as error:
        raise ValueError(f"cannot be read: {error.strerror}") from error
    if len(data) > max_bytes:
        kilobytes = max_bytes // 1024
        size = f"{kilobytes // 1024} MB" if kilobytes >= 1024 else f"{kilobytes} KB"
        raise ValueError(f"is larger than {size}")
    try:
        return ElementTree.fromstring(data, ElementTree.XMLParser(target=_Builder()))
    except _DoctypeFound:
        raise ValueError("declares a DOCTYPE, which is not allowed") from None
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        # ValueError and LookupError: encodings that expat cannot read or that Python does not know.
        raise ValueError(f"is not XML: {printable(str(error))}") from error
