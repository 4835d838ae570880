"""Read a package.xml, or another file of XML, without trusting it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

from catkin_pkg.condition import evaluate_condition

from grader.sanitize import printable

MAX_BYTES = 256 * 1024  # that of rclcpp, a long one, has 4 KB
_MAX_CONDITION = 200
_CONDITION_VALUES = {"ROS_VERSION": "2", "ROS_DISTRO": "jazzy", "ROS_PYTHON_VERSION": "3"}


@dataclass(frozen=True)
class PackageXml:
    """The content of a package.xml, without what its `condition` leaves out of ROS 2 Jazzy.

    If it could not be read, `problem` says why (with the line); the rest is empty.
    """

    name: str = ""
    format: str = ""
    build_type: str = ""
    elements: tuple[tuple[str, str], ...] = ()
    problem: str = ""

    def texts(self, *tags: str) -> list[str]:
        """Return the texts of the elements directly below `package` that have one of these tags."""
        return [text for tag, text in self.elements if tag in tags]


def read_package_xml(path: Path) -> PackageXml:
    """Return the content of `path`; for a file that is not XML, a PackageXml with only a `problem`."""
    try:
        root = read_xml(path, MAX_BYTES)
    except ValueError as error:
        return PackageXml(problem=str(error))
    if root.tag != "package":
        return PackageXml()
    elements = tuple((child.tag, "".join(child.itertext()).strip()) for child in root if _counts(child))
    names = [text for tag, text in elements if tag == "name"]
    build_types = [(child.text or "").strip() for child in root.findall("export/build_type") if _counts(child)]
    return PackageXml(names[0] if names else "", root.get("format", "1"), (build_types or [""])[-1], elements)


def _counts(element: Element) -> bool:
    """Return whether an element's condition (REP 149) holds here. One that cannot be read does; it is reported."""
    condition = element.get("condition", "")
    try:
        return not condition or len(condition) > _MAX_CONDITION or evaluate_condition(condition, _CONDITION_VALUES)
    except (ValueError, RecursionError):
        return True


class _DoctypeFound(Exception):
    """A document type was declared, which allows entity expansion."""


class _Builder(ElementTree.TreeBuilder):
    def doctype(self, *_: object) -> NoReturn:
        raise _DoctypeFound


def read_xml(path: Path, max_bytes: int) -> Element:
    """Return the root element of a submission's file: with a size limit, and without a DOCTYPE, which can be a bomb.

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
