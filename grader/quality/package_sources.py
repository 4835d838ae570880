"""What the search for faults reads of a package: its paths, package.xml, CMakeLists.txt and setup.py."""

from __future__ import annotations

import ast
import difflib
import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path, PurePosixPath

from grader import python_ast
from grader.contract.spec import PACKAGE
from grader.host import ros_env
from grader.intake.package_xml import PackageXml, read_package_xml
from grader.python_ast import called, literal_string
from grader.quality import cmake_text
from grader.quality.source_files import package_files

INTERFACE_SUFFIXES = (".msg", ".srv", ".action")
_MAX_TEXT = 64 * 1024
_ENTRY_POINT = re.compile(r"\s*(?P<name>[\w.-]+)\s*=\s*(?P<module>[\w.]+)\s*:\s*(?P<function>[\w.]+)\s*")


@dataclass(frozen=True)
class EntryPoint:
    """An entry of console_scripts in setup.py; `text` as it is written, the rest empty where it is malformed."""

    text: str
    line: int
    name: str = ""
    module: str = ""
    function: str = ""


@dataclass(frozen=True)
class SetupPy:
    """What the call of setup() in a setup.py says, as far as it is written out."""

    name: str
    line: int
    entry_points: tuple[EntryPoint, ...]
    data_files: str | None
    """The text of the argument data_files, None if there is none."""


@dataclass(frozen=True)
class PackageSources:
    """A package's text. `handed_in` are the names of the packages of the submission, its own among them."""

    folder: Path
    paths: tuple[str, ...]
    xml: PackageXml
    cmake: cmake_text.CMakeText | None
    setup: SetupPy | None
    handed_in: frozenset[str]
    known: frozenset[str] = field(repr=False)
    """The ROS packages that are installed here."""

    @property
    def name(self) -> str:
        """Return the package's name by package.xml, or else the contract's."""
        return self.xml.name or PACKAGE

    @property
    def names(self) -> frozenset[str]:
        """Return its names by package.xml and by project(), which are the same in a package that is right."""
        projects = self.cmake.named("project") if self.cmake is not None else []
        return frozenset({self.name, *(command.arguments[0] for command in projects if command.arguments)})

    @property
    def by_cmake(self) -> bool:
        """Return whether colcon builds it with CMakeLists.txt."""
        return self.cmake is not None and self.xml.build_type != "ament_python"

    @cached_property
    def interfaces(self) -> list[str]:
        """Return the paths of its interface files: srv/SetSpeed.srv."""
        parts = [PurePosixPath(path) for path in self.paths]
        return [
            str(path) for path in parts
            if path.suffix in INTERFACE_SUFFIXES and len(path.parts) == 2 and path.parts[0] == path.suffix[1:]
        ]  # fmt: skip

    def read(self, path: str) -> str:
        """Return the start of a file's text, "" if it cannot be read."""
        try:
            with (self.folder / path).open("rb") as stream:
                return stream.read(_MAX_TEXT).decode("utf-8", "replace")
        except OSError:
            return ""

    def line_of(self, path: str, words: str) -> int:
        """Return the first line of a file with these words, 0 if there is none."""
        before, found, _ = self.read(path).partition(words)
        return before.count("\n") + 1 if found else 0


def read_sources(folder: Path, interfaces: Path | None) -> PackageSources:
    """Return the text of the package in `folder`; `interfaces` is its package of interfaces, if it has one."""
    paths = tuple(package_files(folder))
    has_xml = "package.xml" in paths
    xml = read_package_xml(folder / "package.xml") if has_xml else PackageXml(problem="is not there")
    sources = PackageSources(folder, paths, xml, None, None, frozenset(), frozenset())
    handed_in = {sources.name, PACKAGE}
    if interfaces is not None:
        handed_in.add(read_package_xml(interfaces / "package.xml").name or interfaces.name)
    share = ros_env.PREFIX / "share"
    return PackageSources(
        folder, paths, xml,
        cmake=cmake_text.read(sources.read("CMakeLists.txt")) if "CMakeLists.txt" in paths else None,
        setup=_setup_py(sources.read("setup.py")) if "setup.py" in paths else None,
        handed_in=frozenset(handed_in),
        known=frozenset(path.parent.name for path in share.glob("*/package.xml")),
    )  # fmt: skip


def similar(name: str, others: Iterable[str]) -> str:
    """Return the one of `others` that was probably meant by `name`, "" if none is like it."""
    by_lower = {other.lower(): other for other in others}
    found = difflib.get_close_matches(name.lower(), by_lower, 1, 0.75)
    return by_lower[found[0]] if found else ""


def _setup_py(text: str) -> SetupPy | None:
    tree = python_ast.parse(text)
    calls = [node for node in ast.walk(tree) if isinstance(node, ast.Call)] if tree else []
    call = next((call for call in calls if called(call) == "setup"), None)
    if tree is None or call is None:
        return None
    named = {keyword.arg: keyword.value for keyword in call.keywords}
    names = {
        target.id: literal_string(node.value)
        for node in tree.body if isinstance(node, ast.Assign)
        for target in node.targets if isinstance(target, ast.Name)
    }  # fmt: skip
    name = named.get("name")
    data_files = named.get("data_files")
    return SetupPy(
        name=names.get(name.id, "") if isinstance(name, ast.Name) else literal_string(name),
        line=name.lineno if name is not None else call.lineno,
        entry_points=tuple(_entry_points(named.get("entry_points"))),
        data_files=None if data_files is None else ast.get_source_segment(text, data_files) or "",
    )


def _entry_points(node: ast.expr | None) -> list[EntryPoint]:
    groups = zip(node.keys, node.values, strict=True) if isinstance(node, ast.Dict) else ()
    scripts = next((value for key, value in groups if literal_string(key) == "console_scripts"), None)
    entries = scripts.elts if isinstance(scripts, ast.List | ast.Tuple) else []
    found = []
    for entry in entries:
        text = literal_string(entry)
        if text:
            match = _ENTRY_POINT.fullmatch(text)
            found.append(EntryPoint(text, entry.lineno, **(match.groupdict() if match else {})))
    return found
