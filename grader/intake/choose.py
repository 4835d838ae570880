"""Find the packages in an unpacked submission, choose the one to grade and say why; or refuse with the choices named.

Runs nothing.
"""

from __future__ import annotations

import os
import re
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from grader.course import Course
from grader.errors import SubmissionError, UsageError
from grader.intake.containers import ARCHIVE_SUFFIXES, CLOSED_ARCHIVES
from grader.intake.package_xml import PackageXml, read_package_xml
from grader.sanitize import printable
from grader.words import mark, say, some

_NAMED = 5  # packages named in a sentence
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


# -- the choice --------------------------------------------------------------------------------------------------------
def choose(tree: Tree, name: str, path: str = "") -> tuple[Candidate, str]:
    """Return the package of the submission `name` that is to be graded, and why it was chosen ("because ...").

    It is the one at `path`, whatever it is; without a path, that of the assignment's name, else the only one with
    modules of the assignment, else the only one with a node in Python. Like colcon, it does not look for packages
    inside such a package.

    Raises:
        SubmissionError: there is none, and the message says what there is instead; or there are several.
        UsageError: there is no package at `path`; the message says where there are some.
    """
    if path:
        if (found := find_named(tree, path)) is not None:
            return found, say("`--package-path` names it")
        paths = some([printable(candidate.path) for candidate in tree.candidates], _NAMED)
        raise UsageError(
            say("There is no package at {path} in {name}.", path=printable(path), name=printable(name)),
            say("It has packages at {paths}.", paths=paths) if paths else say("It holds no package at all."),
        )
    gradable = [c for c in tree.candidates if c.name == tree.course.package or c.modules or c.nodes]
    pool = [c for c in gradable if not _nearest(c.path, {other.path for other in gradable})]
    if not pool:
        what, advice = _describe_instead(tree)
        raise SubmissionError(f"{printable(name)} {what}", advice)
    several = len(tree.candidates) > 1
    because = say("it is the only ROS 2 Python package that colcon finds") if several else say("it is the only package")
    if len(pool) > 1 and (named := [c for c in pool if c.name == tree.course.package]):
        pool, because = named, say("its name is the one that the assignment asks for")
    if len(pool) > 1 and (ours := [c for c in pool if c.modules]) and len(ours) < len(pool):
        pool, because = ours, say("it is the only one with modules of the assignment")
    if len(pool) > 1:
        paths = some([f"{printable(c.path)} ({c.name})" for c in pool], _NAMED)
        words = mark("{name} holds {count} packages, and nothing tells which is meant: {paths}.")
        raise SubmissionError(
            say(words, name=printable(name), count=len(pool), paths=paths),
            say(
                "Hand in one of them, or choose with `grader grade --package-path PATH`; in a class `package: PATH` "
                "in overrides.yaml chooses. `grader batch` grades the packages of several people."
            ),
        )
    return pool[0], because


def find_named(tree: Tree, path: str) -> Candidate | None:
    """Return the candidate at `path`, the folder or its package.xml; None if there is none."""
    wanted = PurePosixPath(path.removesuffix("package.xml") or ".").as_posix()
    return next((candidate for candidate in tree.candidates if candidate.path == wanted), None)


def interfaces_beside(tree: Tree, package: Candidate) -> Candidate | None:
    """Return the package of the interfaces if the submission has split them off; the nearest if there are several.

    It may have any name if it has interfaces of the contract that the package itself has not, and no nodes.
    """
    names = (tree.course.interfaces_package, f"{package.name}_interfaces")
    found = [c for c in tree.candidates if c != package]
    split = [
        c for c in found if c.name in names or (c.interfaces - package.interfaces and not c.modules and not c.nodes)
    ]
    return min(split, key=lambda c: (c.name not in names, _parent(c.path) != _parent(package.path)), default=None)


def _describe_instead(tree: Tree) -> tuple[str, str]:
    """Return the predicate of a sentence about a submission without a package, and advice."""
    suffixes = {PurePosixPath(path).suffix.lower() for path in tree.files}
    closed = [path for path in tree.files if path.lower().endswith((*ARCHIVE_SUFFIXES, *CLOSED_ARCHIVES))]
    if not tree.files:
        advice = say("Put the package folder in (the one with package.xml and setup.py) and submit again.")
        return say("is empty."), advice
    if tree.candidates:
        words = mark("contains no package with a node in Python, only {packages}.")
        nodes = ", ".join(f"{node}.py" for node in tree.course.nodes)
        return (
            say(words, packages=some([candidate.name for candidate in tree.candidates], _NAMED)),
            say("The assignment asks for a ROS 2 Jazzy package with nodes in Python: {nodes}.", nodes=nodes),
        )
    if ".ipynb" in suffixes and ".py" not in suffixes:
        words = mark("Submit the package that they write, the folder {package} with package.xml.")
        return say("contains only notebooks."), say(words, package=tree.course.package)
    if closed:
        what = say("contains an archive that was not opened ({path}).", path=printable(closed[0]))
        return what, say("Submit the package folder in one plain zip.")
    advice = say("Zip the package folder itself (the one with package.xml and setup.py) and submit again.")
    return say("contains no package.xml."), advice


def remark(candidate: Candidate) -> str:
    """Return where a package is and its name, and if it lies where colcon does not look."""
    inside = say("inside {package}, where colcon does not look", package=printable(candidate.inside))
    return f"{printable(candidate.path)} ({candidate.name}{f'; {inside}' if candidate.inside else ''})"
