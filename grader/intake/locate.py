"""Find the folders of an unpacked submission that may be the package. choose.py takes one of them. Runs nothing."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from grader.course import Course
from grader.intake.package_xml import PackageXml, read_package_xml

_IGNORE_MARKERS = frozenset({"COLCON_IGNORE", "AMENT_IGNORE"})

_NODE = re.compile(rb"^[ \t]*(?:import|from)[ \t]+rclpy\b", re.MULTILINE)
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_-]{0,99}")
_MAX_SOURCE_BYTES = 1024**2


@dataclass(frozen=True)
class Candidate:
    """A folder that may be the package.

    Attributes:
        path: relative to the submission, "." for its root.
        xml: its package.xml.
        modules: the names of the contract's modules that it has, anywhere in it.
        interfaces: the file names of the contract's interfaces that it has.
        nodes: how many of its Python files import rclpy.
        inside: the path of the package that it lies in, "" if in none. colcon does not look inside a package.
    """

    path: str
    xml: PackageXml
    modules: frozenset[str]
    interfaces: frozenset[str]
    nodes: int
    inside: str = ""

    @property
    def name(self) -> str:
        """Return the name in package.xml if it is valid, else the folder's name, made valid."""
        if _NAME.fullmatch(self.xml.name):
            return self.xml.name
        folder = re.sub(r"[^A-Za-z0-9_-]", "_", PurePosixPath(self.path).name)
        return folder if _NAME.fullmatch(folder) else "package"


@dataclass(frozen=True)
class Tree:
    """An unpacked submission: its files, those of them that are searched, and the candidates in it by path."""

    root: Path
    files: tuple[str, ...]
    searched: tuple[str, ...]
    course: Course
    candidates: tuple[Candidate, ...]


def survey(root: Path, course: Course) -> Tree:
    """Return the files below `root` and the candidates among its folders."""
    walked = (Path(folder, name) for folder, _, names in os.walk(root) for name in names)
    files = tuple(sorted(path.relative_to(root).as_posix() for path in walked))
    ignored = {_parent(path) for path in files if PurePosixPath(path).name in _IGNORE_MARKERS}
    searched = tuple(path for path in files if not _nearest(path, ignored))
    packages = {_parent(path) for path in searched if PurePosixPath(path).name == "package.xml"}
    owned: dict[str, list[str]] = {package: [] for package in sorted(packages)}
    for path in searched:
        if owner := _nearest(path, packages):
            owned[owner].append(path)
    candidates = (_candidate(root, course, each, its, _nearest(each, packages)) for each, its in owned.items())
    return Tree(root, files, searched, course, tuple(candidates))


def _parent(path: str) -> str:
    return PurePosixPath(path).parent.as_posix()


def _nearest(path: str, folders: set[str]) -> str:
    """Return the innermost of `folders` that `path` is in, "" if it is in none."""
    return next((p.as_posix() for p in PurePosixPath(path).parents if p.as_posix() in folders), "")


def _candidate(root: Path, course: Course, path: str, files: list[str], inside: str) -> Candidate:
    # By file names alone, without their folders: a student may have put them elsewhere.
    names = {PurePosixPath(file).name for file in files}
    modules = {PurePosixPath(file).name for file in course.modules}
    interfaces = {PurePosixPath(course.interface_file(name)).name for name in course.interfaces}
    return Candidate(
        path=path,
        xml=read_package_xml(root / path / "package.xml"),
        modules=frozenset(names & modules),
        interfaces=frozenset(names & interfaces),
        nodes=sum(_is_node(root / file) for file in files),
        inside=inside,
    )


def _is_node(path: Path) -> bool:
    """Return whether a file is Python that imports rclpy, as far as its first megabyte shows."""
    if not path.name.endswith(".py"):
        return False
    with path.open("rb") as file:
        return _NODE.search(file.read(_MAX_SOURCE_BYTES)) is not None
