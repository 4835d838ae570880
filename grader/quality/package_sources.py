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
from grader.course import Course
from grader.host import ros_env
from grader.intake.package_xml import PackageXml, read_package_xml
from grader.python_ast import called, literal_string
from grader.quality import cmake_text
from grader.quality.source_files import package_files

INTERFACE_SUFFIXES = (".msg", ".srv", ".action")
_MAX_TEXT = 256 * 1024


@dataclass(frozen=True)
class SetupPy:
    """What the call of setup() in a setup.py says: on which line the package's name is, and which programs it makes.

    `programs` are the names of the entry points of console_scripts, None where they are not all written out.
    """

    line: int
    programs: frozenset[str] | None


@dataclass(frozen=True)
class PackageSources:
    """A package's text. `built` are the names of the packages that are built together, its own among them."""

    course: Course
    folder: Path
    paths: tuple[str, ...]
    xml: PackageXml
    cmake: cmake_text.CMakeText
    setup: SetupPy | None
    built: frozenset[str]
    known: frozenset[str] = field(repr=False)
    """The ROS packages that are installed here."""

    @property
    def name(self) -> str:
        """Return the package's name by package.xml, or else the contract's."""
        return self.xml.name or self.course.package

    @property
    def names(self) -> frozenset[str]:
        """Return its names by package.xml and by project(), which are the same in a package that is right."""
        return frozenset({self.name, *(c.arguments[0] for c in self.cmake.named("project") if c.arguments)})

    @property
    def has_cmake(self) -> bool:
        """Return whether it has a CMakeLists.txt."""
        return "CMakeLists.txt" in self.paths

    @property
    def by_cmake(self) -> bool:
        """Return whether colcon builds it with CMakeLists.txt."""
        return self.has_cmake and self.xml.build_type != "ament_python"

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


def read_sources(folder: Path, interfaces: Path | None, course: Course) -> PackageSources:
    """Return the text of the package in `folder`; `interfaces` is its package of interfaces, if it has one."""
    paths = tuple(package_files(folder, course))
    has_xml = "package.xml" in paths
    xml = read_package_xml(folder / "package.xml") if has_xml else PackageXml(problem="is not there")
    sources = PackageSources(course, folder, paths, xml, cmake_text.CMakeText(()), None, frozenset(), frozenset())
    built = {sources.name}
    if interfaces is not None:
        built.add(read_package_xml(interfaces / "package.xml").name or interfaces.name)
    return PackageSources(
        course, folder, paths, xml,
        cmake=cmake_text.read(sources.read("CMakeLists.txt")) if sources.has_cmake else sources.cmake,
        setup=_setup_py(sources.read("setup.py")) if "setup.py" in paths else None,
        built=frozenset(built),
        known=frozenset(path.parent.name for share in ros_env.share_folders() for path in share.glob("*/package.xml")),
    )  # fmt: skip


def similar(name: str, others: Iterable[str]) -> str:
    """Return the one of `others` that was probably meant by `name`, "" if none is like it.

    Of paths and dotted names only one part may differ: a file of another folder is not meant.
    """
    parts = re.split("[/.]", name.lower())
    split = [(re.split("[/.]", other.lower()), other) for other in sorted(set(others) - {name})]
    split = [(theirs, other) for theirs, other in split if len(theirs) == len(parts)]
    for at, part in enumerate(parts):
        rest = (parts[:at], parts[at + 1 :])
        near = {theirs[at]: other for theirs, other in split if (theirs[:at], theirs[at + 1 :]) == rest}
        if matches := difflib.get_close_matches(part, near, 1, 0.75):
            return near[matches[0]]
    return ""


def _setup_py(text: str) -> SetupPy | None:
    tree = python_ast.parse(text)
    calls = [node for node in ast.walk(tree) if isinstance(node, ast.Call)] if tree else []
    call = next((call for call in calls if called(call) == "setup"), None)
    if tree is None or call is None:
        return None
    named = {keyword.arg: keyword.value for keyword in call.keywords}
    name = named.get("name")
    programs = None if {None, "scripts"} & set(named) else _programs(named.get("entry_points"))
    return SetupPy(name.lineno if name is not None else call.lineno, programs)


def _programs(node: ast.expr | None) -> frozenset[str] | None:
    """Return the names of the entry points, None where they are not all written out."""
    if node is None:
        return frozenset()
    if not isinstance(node, ast.Dict):
        return None
    tables = dict(zip(map(literal_string, node.keys), node.values, strict=True))
    texts = [literal_string(entry) for entry in getattr(tables.get("console_scripts", ast.List([])), "elts", [None])]
    is_whole = "" not in tables and all(texts)
    return frozenset(text.partition("=")[0].strip() for text in texts) if is_whole else None
