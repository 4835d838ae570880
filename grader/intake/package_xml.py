"""Read a package.xml without trusting it."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from catkin_pkg.condition import evaluate_condition

from grader.intake.xml_reader import read_xml

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

    @property
    def ros1(self) -> bool:
        """Return whether the package is built by catkin, the build tool of ROS 1."""
        tools = self.texts("buildtool_depend")
        return "catkin" in (*tools, self.build_type) and not any(tool.startswith("ament") for tool in tools)


def read_package_xml(path: Path) -> PackageXml:
    """Return the content of `path`; for a file that is not XML, a PackageXml with only a `problem`."""
    reader = _Reader()
    problem = read_xml(path, MAX_BYTES, reader.start, reader.end, reader.text.append)
    return PackageXml(problem=problem) if problem else reader.result()


@dataclass
class _Reader:
    """Collects the text of the elements below `package`, and the build type below `export`."""

    text: list[str] = field(default_factory=list)
    _open: list[str] = field(default_factory=list)
    _elements: list[tuple[str, str]] = field(default_factory=list)
    _format: str = ""
    _build_type: str = ""
    _left_out: bool = False

    def result(self) -> PackageXml:
        names = [text for tag, text in self._elements if tag == "name"]
        return PackageXml(names[0] if names else "", self._format, self._build_type, tuple(self._elements))

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        if not self._open:
            self._format = attributes.get("format", "1") if tag == "package" else ""
        self._open.append(tag)
        self._left_out = not _holds(attributes.get("condition", ""))
        self.text.clear()

    def end(self, tag: str) -> None:
        text = "".join(self.text).strip()
        if self._open[:1] == ["package"] and not self._left_out:
            if len(self._open) == 2:
                self._elements.append((tag, text))
            elif self._open == ["package", "export", "build_type"]:
                self._build_type = text
        self._open.pop()
        self._left_out = False
        self.text.clear()


def _holds(condition: str) -> bool:
    """Return whether a condition of REP 149 holds here; one that cannot be read does, and is reported as invalid."""
    try:
        return not condition or len(condition) > _MAX_CONDITION or evaluate_condition(condition, _CONDITION_VALUES)
    except (ValueError, RecursionError):
        return True
