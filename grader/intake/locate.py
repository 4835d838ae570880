"""Find the package in an unpacked submission, or explain in one sentence why there is none. Runs nothing."""

from __future__ import annotations

import os
import re
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath

from grader.contract import spec
from grader.errors import SubmissionError
from grader.intake.containers import ARCHIVE_SUFFIXES
from grader.intake.copy_plan import BUILD_NAMES
from grader.intake.package_xml import PackageXml, read_package_xml
from grader.sanitize import printable

# File names of the contract, without their folders: a student may have put them elsewhere.
_MODULES = frozenset(PurePosixPath(path).name for path in (*spec.NODE_MODULES, spec.CONVERSIONS_MODULE))
_INTERFACES = frozenset(f"{name}.{kind}" for kind, name in (interface.split("/") for interface in spec.INTERFACES))
_IGNORE_MARKERS = frozenset({"COLCON_IGNORE", "AMENT_IGNORE"})

_ASKED = "The assignment asks for nodes in Python: robot_controller.py and sensor_processor.py."
_ZIP = "Zip the package folder itself (the one with package.xml and setup.py) and submit again."

_CPP = frozenset({".cpp", ".cc", ".cxx", ".hpp"})
_DOCUMENTS = frozenset(
    {"", ".md", ".txt", ".rst", ".pdf", ".doc", ".docx", ".odt", ".rtf", ".tex", ".pptx", ".html"}
    | {".png", ".jpg", ".jpeg", ".gif", ".svg"}
)
_CLOSED_ARCHIVES = frozenset(
    {".rar", ".7z", ".zst", ".gz", ".iso", *(suffix for suffix in ARCHIVE_SUFFIXES if suffix.count(".") == 1)}
)

_NODE = re.compile(rb"^[ \t]*(?:import|from)[ \t]+rclpy\b", re.MULTILINE)
_ROS1 = re.compile(
    rb"^[ \t]*(?:import|from)[ \t]+rospy\b|find_package\(\s*catkin\b|#include\s*<ros/ros\.h>", re.MULTILINE
)
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_-]{0,99}")
_MAX_SOURCE_BYTES = 1024**2


@dataclass(frozen=True)
class Candidate:
    """A folder that may be the package. `path` is relative to the submission, "." for its root."""

    path: str
    xml: PackageXml | None
    files: tuple[str, ...]
    modules: frozenset[str]
    interfaces: frozenset[str]
    nodes: int

    @property
    def name(self) -> str:
        """Return the name in package.xml if it is valid, else the folder's name, made valid."""
        named = self.xml.name if self.xml else ""
        if _NAME.fullmatch(named):
            return named
        folder = re.sub(r"[^A-Za-z0-9_-]", "_", PurePosixPath(self.path).name)
        return folder if _NAME.fullmatch(folder) else "package"

    @property
    def rank(self) -> tuple[bool, int, int, int, int, str]:
        """Return the sort key of candidates; the smallest is the package."""
        exact = self.xml is not None and self.xml.name == spec.PACKAGE
        depth = 0 if self.path == "." else self.path.count("/") + 1
        return (not exact, -len(self.modules), -len(self.interfaces), -self.nodes, depth, self.path)


@dataclass(frozen=True)
class Tree:
    """An unpacked submission: its files, those of them that are searched, and its candidates, best first."""

    root: Path
    files: tuple[str, ...]
    searched: tuple[str, ...]
    candidates: tuple[Candidate, ...] = field(default=())

    def source(self, path: str) -> bytes:
        """Return the first megabyte of a file, enough to recognise it."""
        with (self.root / path).open("rb") as file:
            return file.read(_MAX_SOURCE_BYTES)


def survey(root: Path) -> Tree:
    """Return the files below `root` and the candidates among its folders."""
    files = tuple(sorted(_files(root)))
    ignored = {_parent(path) for path in files if PurePosixPath(path).name in _IGNORE_MARKERS}
    ignored |= _build_trees(files)
    searched = tuple(path for path in files if not _ignored(path, ignored) and not _installed(path))
    tree = Tree(root, files, searched)
    return Tree(root, files, searched, tuple(sorted(_candidates(tree), key=lambda candidate: candidate.rank)))


def choose(tree: Tree, name: str) -> Candidate:
    """Return the package among the candidates.

    Raises:
        SubmissionError: there is none; the message says what the submission `name` has instead.
    """
    usable = [candidate for candidate in tree.candidates if not _wrong_kind(tree, candidate)]
    if usable:
        return usable[0]
    raise SubmissionError(f"{printable(name)} {_describe_instead(tree)}")


def interfaces_beside(tree: Tree, package: Candidate) -> Candidate | None:
    """Return the package of the interfaces if the submission has split them off; the nearest if there are several."""
    found = [
        c for c in tree.candidates if c.xml is not None and c.xml.name == spec.INTERFACES_PACKAGE and c is not package
    ]
    return min(found, key=lambda c: (_parent(c.path) != _parent(package.path), c.rank), default=None)


def _files(root: Path) -> list[str]:
    return [(Path(folder) / name).relative_to(root).as_posix() for folder, _, names in os.walk(root) for name in names]


def _parent(path: str) -> str:
    return PurePosixPath(path).parent.as_posix()


def _ignored(path: str, ignored: set[str]) -> bool:
    return any(parent.as_posix() in ignored for parent in PurePosixPath(path).parents)


def _build_trees(files: tuple[str, ...]) -> set[str]:
    """Return the build folders: those of a workspace are beside its src."""
    folders = {parent.as_posix() for path in files for parent in PurePosixPath(path).parents}
    return {f for f in folders if PurePosixPath(f).name in BUILD_NAMES and _sibling(f, "src") in folders}


def _sibling(path: str, name: str) -> str:
    return PurePosixPath(path).with_name(name).as_posix()


def _installed(path: str) -> bool:
    """Return whether `path` is in an install tree: share/NAME/package.xml."""
    folders = PurePosixPath(path).parts[:-1]
    return len(folders) >= 2 and folders[-2] == "share"


def _candidates(tree: Tree) -> list[Candidate]:
    by_folder: dict[str, set[str]] = {}
    for path in tree.searched:
        by_folder.setdefault(_parent(path), set()).add(PurePosixPath(path).name)
    modules = {_parent(path) for path in tree.searched if PurePosixPath(path).name in _MODULES}
    roots = {folder for folder, names in by_folder.items() if "package.xml" in names}
    for folder, names in by_folder.items():
        has_modules = any(folder in (".", m) or m.startswith(folder + "/") for m in modules)
        # A folder inside a package is not a package of its own.
        inside = any(p.as_posix() in roots for p in (PurePosixPath(folder), *PurePosixPath(folder).parents))
        if names & {"setup.py", "CMakeLists.txt"} and has_modules and not inside:
            roots.add(folder)
    owned: dict[str, list[str]] = {root: [] for root in roots}
    for path in tree.searched:
        owner = next((p.as_posix() for p in PurePosixPath(path).parents if p.as_posix() in roots), None)
        if owner is not None:
            owned[owner].append(path)
    return [_candidate(tree, root, files) for root, files in owned.items()]


def _candidate(tree: Tree, root: str, files: list[str]) -> Candidate:
    names = {PurePosixPath(path).name for path in files}
    xml = (PurePosixPath(root) / "package.xml").as_posix()
    return Candidate(
        path=root,
        xml=read_package_xml(tree.root / xml) if xml in files else None,
        files=tuple(files),
        modules=frozenset(names & _MODULES),
        interfaces=frozenset(names & _INTERFACES),
        nodes=sum(1 for path in files if path.endswith(".py") and _NODE.search(tree.source(path))),
    )


def _wrong_kind(tree: Tree, candidate: Candidate) -> str:
    """Return "ROS 1" or "C++" for a package of the wrong kind, else ""."""
    suffixes = {PurePosixPath(path).suffix for path in candidate.files}
    if candidate.xml is not None and candidate.xml.ros1:
        return "ROS 1"
    if candidate.nodes == 0 and any(
        _ROS1.search(tree.source(p)) for p in candidate.files if p.endswith((".py", "CMakeLists.txt"))
    ):
        return "ROS 1"
    if suffixes & _CPP and not any(
        p.endswith(".py") and not p.endswith((".launch.py", "_launch.py", "setup.py")) for p in candidate.files
    ):
        return "C++"
    return ""


def _describe_instead(tree: Tree) -> str:
    """Return the predicate of a sentence about a submission without a package, and advice."""
    suffixes = Counter(PurePosixPath(path).suffix.lower() for path in tree.files)
    if not tree.files:
        return "is empty. Put the package folder in (the one with package.xml and setup.py) and submit again."
    kinds = {_wrong_kind(tree, candidate) for candidate in tree.candidates}
    if "ROS 1" in kinds:
        return "contains a ROS 1 (catkin) package. The assignment asks for a ROS 2 Jazzy package with nodes in Python."
    if "C++" in kinds:
        return f"contains a C++ package. {_ASKED}"
    if ignored := [p for p in tree.files if p.endswith("package.xml") and p not in tree.searched]:
        return (
            f"contains a package only where colcon does not look ({printable(ignored[0])}: a build tree, or a folder "
            "marked COLCON_IGNORE). Submit the sources, the package folder in src."
        )
    nodes = [path for path in tree.searched if path.endswith(".py") and _NODE.search(tree.source(path))]
    if nodes:
        return f"contains a node ({printable(nodes[0])}) but no package.xml. {_ZIP}"
    if any(
        _ROS1.search(tree.source(path)) for path in tree.searched if path.endswith((".py", "CMakeLists.txt", ".cpp"))
    ):
        return "contains code for ROS 1. The assignment asks for a ROS 2 Jazzy package with nodes in Python."
    if set(suffixes) & _CPP and not suffixes[".py"]:
        return (
            "contains only C++. The assignment asks for nodes in Python: robot_controller.py and sensor_processor.py."
        )
    if suffixes[".ipynb"] and not suffixes[".py"]:
        return (
            "contains only notebooks. "
            "Submit the package that they write, the folder ros2_robot_controller with package.xml."
        )
    if closed := [path for path in tree.files if PurePosixPath(path).suffix.lower() in _CLOSED_ARCHIVES]:
        return (
            f"contains an archive that was not opened ({printable(closed[0])}). "
            "Submit the package folder in one plain zip."
        )
    if set(suffixes) <= _DOCUMENTS:
        return (
            f"contains only documents ({printable(tree.files[0])}). "
            "Submit the package folder, the one with package.xml and setup.py."
        )
    return f"contains no package.xml. {_ZIP}"
