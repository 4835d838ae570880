"""Tell a ROS 2 Python package from other kinds of packages, and say what a submission has instead of one."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import PurePosixPath

from grader.course import Course
from grader.intake.containers import ARCHIVE_SUFFIXES, CLOSED_ARCHIVES
from grader.intake.locate import Candidate, Tree
from grader.sanitize import printable
from grader.words import mark, say, some

_ZIP = mark("Zip the package folder itself (the one with package.xml and setup.py) and submit again.")

_CPP = frozenset({".cpp", ".cc", ".cxx", ".c", ".hpp", ".hh"})
_NO_CODE = frozenset(
    {".msg", ".srv", ".action", ".launch", ".urdf", ".xacro", ".sdf", ".world", ".rviz", ".stl", ".dae"}
)
_LAUNCH_FILES = (".launch.py", "_launch.py", ".launch.xml", ".launch.yaml")
_ARCHIVES = frozenset({*CLOSED_ARCHIVES, ".gz", *(suffix for suffix in ARCHIVE_SUFFIXES if suffix.count(".") == 1)})
_NAMED = 4  # packages named in a refusal

# Python files of a package that are no code of a node's.
_BESIDE = frozenset({"setup.py", "conftest.py", "conf.py", "__init__.py"})
_BESIDE_FOLDERS = frozenset({"launch", "test", "tests"})

_ROS1 = re.compile(
    rb"^[ \t]*(?:import|from)[ \t]+rospy\b|find_package\(\s*catkin\b|#include\s*<ros/ros\.h>", re.MULTILINE
)

ROS1, CPP, BARE, NO_NODE = "ROS 1", "C++", mark("no code"), mark("messages, launch or description files only")


def kind(tree: Tree, candidate: Candidate) -> str:
    """Return the kind of a package that is no ROS 2 Python package, one of the words above; else "".

    A package with the assignment's name is only refused for the wrong language: it may be an early state.
    """
    if candidate.xml is not None and candidate.xml.ros1:
        return ROS1
    if candidate.nodes == 0 and _ros1(tree, candidate.files):
        return ROS1
    if candidate.nodes or candidate.modules:
        return ""
    suffixes = {PurePosixPath(path).suffix.lower() for path in candidate.files}
    code = any(_is_code(path, candidate.path) for path in candidate.files)
    named = candidate.name == tree.course.package
    if suffixes & _CPP and not (named and code):
        return CPP
    if named or code:
        return ""
    launches = any(path.endswith(_LAUNCH_FILES) for path in candidate.files)
    return NO_NODE if launches or suffixes & _NO_CODE else BARE


def describe_instead(tree: Tree) -> tuple[str, str]:
    """Return the predicate of a sentence about a submission without a package, and advice."""
    suffixes = {PurePosixPath(path).suffix.lower() for path in tree.files}
    asked = _asked(tree.course)
    if not tree.files:
        return (
            say("is empty."),
            say("Put the package folder in (the one with package.xml and setup.py) and submit again."),
        )
    if tree.candidates:
        return _packages([(candidate.name, kind(tree, candidate)) for candidate in tree.candidates]), asked
    if ignored := [p for p in tree.files if p.endswith("package.xml") and p not in tree.searched]:
        return (
            say(
                "contains a package only where colcon does not look ({path}: a build tree, or a folder marked "
                "COLCON_IGNORE).",
                path=printable(ignored[0]),
            ),
            say("Submit the sources, the package folder in src."),
        )
    if ".ipynb" in suffixes and ".py" not in suffixes:
        return (
            say("contains only notebooks."),
            say(
                "Submit the package that they write, the folder {package} with package.xml.",
                package=tree.course.package,
            ),
        )
    if closed := [path for path in tree.files if PurePosixPath(path).suffix.lower() in _ARCHIVES]:
        return (
            say("contains an archive that was not opened ({path}).", path=printable(closed[0])),
            say("Submit the package folder in one plain zip."),
        )
    return say("contains no package.xml."), say(_ZIP)


def _asked(course: Course) -> str:
    nodes = ", ".join(f"{node}.py" for node in course.nodes)
    return say("The assignment asks for a ROS 2 Jazzy package with nodes in Python: {nodes}.", nodes=nodes)


def _packages(found: Sequence[tuple[str, str]]) -> str:
    """Return the predicate about packages, given as name and kind, none of which can be graded."""
    shown = some([f"{name} ({say(which)})" for name, which in found], _NAMED)
    if len(found) > 1:
        words = mark("contains {count} packages, and none with a node in Python: {packages}.")
        return say(words, count=len(found), packages=shown)
    return say("contains a package without a node in Python, {package}.", package=shown)


def _is_code(path: str, package: str) -> bool:
    inside = PurePosixPath(path).relative_to(package)
    beside = inside.name in _BESIDE or inside.name.endswith(_LAUNCH_FILES)
    return inside.suffix == ".py" and not beside and not _BESIDE_FOLDERS & set(inside.parts[:-1])


def _ros1(tree: Tree, paths: Sequence[str]) -> bool:
    return any(_ROS1.search(tree.source(path)) for path in paths if path.endswith((".py", "CMakeLists.txt", ".cpp")))
