"""Find the folders of an unpacked submission that may be the package. choose.py takes one of them. Runs nothing."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass, field
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
        files: its files, without those of other candidates in it.
        modules: the names of the contract's modules that it has, anywhere in it.
        interfaces: the file names of the contract's interfaces that it has.
        nodes: how many of its Python files import rclpy.
        inside: the path of the package that it lies in, "" if in none. colcon does not look inside a package.
    """

    path: str
    xml: PackageXml
    files: tuple[str, ...]
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
    candidates: tuple[Candidate, ...] = field(default=())

    def is_node(self, path: str) -> bool:
        """Return whether a file is Python that imports rclpy, as far as its first megabyte shows."""
        if not path.endswith(".py"):
            return False
        with (self.root / path).open("rb") as file:
            return _NODE.search(file.read(_MAX_SOURCE_BYTES)) is not None


def survey(root: Path, course: Course) -> Tree:
    """Return the files below `root` and the candidates among its folders."""
    files = tuple(sorted(_files(root)))
    ignored = {_parent(path) for path in files if PurePosixPath(path).name in _IGNORE_MARKERS}
    searched = tuple(path for path in files if not _nearest(path, ignored))
    tree = Tree(root, files, searched, course)
    return Tree(root, files, searched, course, tuple(sorted(_candidates(tree), key=lambda candidate: candidate.path)))


def _files(root: Path) -> list[str]:
    return [(Path(folder) / name).relative_to(root).as_posix() for folder, _, names in os.walk(root) for name in names]


def _parent(path: str) -> str:
    return PurePosixPath(path).parent.as_posix()


def _candidates(tree: Tree) -> list[Candidate]:
    packages = {_parent(path) for path in tree.searched if PurePosixPath(path).name == "package.xml"}
    owned: dict[str, list[str]] = {package: [] for package in packages}
    for path in tree.searched:
        if owner := _nearest(path, packages):
            owned[owner].append(path)
    return [_candidate(tree, root, files, packages) for root, files in owned.items()]


def _nearest(path: str, folders: set[str]) -> str:
    """Return the innermost of `folders` that `path` is in, "" if it is in none."""
    return next((p.as_posix() for p in PurePosixPath(path).parents if p.as_posix() in folders), "")


def _candidate(tree: Tree, root: str, files: list[str], packages: set[str]) -> Candidate:
    # By file names alone, without their folders: a student may have put them elsewhere.
    names = {PurePosixPath(path).name for path in files}
    course = tree.course
    modules = {PurePosixPath(path).name for path in course.modules}
    interfaces = {PurePosixPath(course.interface_file(name)).name for name in course.interfaces}
    return Candidate(
        path=root,
        xml=read_package_xml(tree.root / root / "package.xml"),
        files=tuple(files),
        modules=frozenset(names & modules),
        interfaces=frozenset(names & interfaces),
        nodes=sum(map(tree.is_node, files)),
        inside=_nearest(root, packages),
    )
