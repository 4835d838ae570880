"""Read a package.xml without trusting it: no entities, no external files, a limit on its size."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers import expat

from grader.sanitize import printable

MOST_BYTES = 256 * 1024  # rclcpp's, a long one, has 4 KB


@dataclass(frozen=True)
class PackageXml:
    """A package.xml. `problem` says why it could not be read (with the line); then the rest is empty."""

    name: str = ""
    format: str = ""
    build_type: str = ""
    elements: tuple[tuple[str, str], ...] = ()
    problem: str = ""

    def texts(self, *tags: str) -> list[str]:
        """Return the texts of the elements right below `package` that have one of these tags."""
        return [text for tag, text in self.elements if tag in tags]

    @property
    def ros1(self) -> bool:
        """Whether catkin, the build tool of ROS 1, builds it."""
        tools = self.texts("buildtool_depend")
        return "catkin" in (*tools, self.build_type) and not any(tool.startswith("ament") for tool in tools)


def read_package_xml(path: Path) -> PackageXml:
    """Return what `path` says. A file that is not XML gives an otherwise empty PackageXml with its problem."""
    try:
        with path.open("rb") as file:
            data = file.read(MOST_BYTES + 1)
    except OSError as error:
        return PackageXml(problem=f"cannot be read: {error.strerror}")
    if len(data) > MOST_BYTES:
        return PackageXml(problem=f"is larger than {MOST_BYTES // 1024} KB")
    reader = _Reader()
    try:
        reader.parser.Parse(data, True)
    except (expat.ExpatError, ValueError, LookupError) as error:
        # LookupError and ValueError: encodings that Python does not know or that expat cannot take.
        return PackageXml(problem=f"is not XML: {printable(str(error))}")
    except _NotAllowed:
        return PackageXml(problem="declares a DOCTYPE, which a package.xml must not")
    return reader.result()


class _NotAllowed(Exception):
    """A document type: the door to entity expansion."""


@dataclass
class _Reader:
    """Collects the text of the elements below `package`, and the build type below `export`."""

    parser: expat.XMLParserType = field(default_factory=expat.ParserCreate)
    _open: list[str] = field(default_factory=list)
    _text: list[str] = field(default_factory=list)
    _elements: list[tuple[str, str]] = field(default_factory=list)
    _format: str = ""
    _build_type: str = ""

    def __post_init__(self) -> None:
        self.parser.StartDoctypeDeclHandler = self._refuse
        self.parser.StartElementHandler = self._start
        self.parser.EndElementHandler = self._end
        self.parser.CharacterDataHandler = self._text.append

    def result(self) -> PackageXml:
        names = [text for tag, text in self._elements if tag == "name"]
        return PackageXml(names[0] if names else "", self._format, self._build_type, tuple(self._elements))

    def _refuse(self, *_: object) -> None:
        raise _NotAllowed

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        if not self._open:
            self._format = attributes.get("format", "1") if tag == "package" else ""
        self._open.append(tag)
        self._text.clear()

    def _end(self, tag: str) -> None:
        text = "".join(self._text).strip()
        if self._open[:1] == ["package"]:
            if len(self._open) == 2:
                self._elements.append((tag, text))
            elif self._open == ["package", "export", "build_type"]:
                self._build_type = text
        self._open.pop()
        self._text.clear()
