"""Lay out a new course: a copy of the small one beside this file."""

from __future__ import annotations

import importlib.util
import keyword
import re
import shutil
from pathlib import Path

from grader.course import Course, load
from grader.errors import UsageError
from grader.intake import package_edits

_TEMPLATE = Path(__file__).parent / "template_course"
_NOT_COPIED = shutil.ignore_patterns("__pycache__", ".*", "ws", "build", "install", "log")
_NAME = re.compile(r"[a-z][a-z0-9]*(?:_[a-z0-9]+)*")
_MOST = 40  # letters of a name
_IMPORTS = re.compile(r"(?:^(?:import|from) .*\n)+", re.MULTILINE)


def lay_out(folder: Path, package: str = "") -> Course:
    """Copy the small course to `folder`, with another name of its package unless that is "", and return it.

    Raises:
        UsageError: there is something in the folder, or ROS or Python would not take the name.
    """
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise UsageError(f"{folder} is not an empty folder; nothing was written.", "Choose a new one.")
    old = load(_TEMPLATE).package
    why = ""
    if package and (not _NAME.fullmatch(package) or keyword.iskeyword(package) or len(package) > _MOST):
        why = f"is no name for a package: small letters, digits and single underscores, {_MOST} at most"
    elif package and package != old and importlib.util.find_spec(package):
        why = "is the name of a Python module that is installed here, which the package would hide"
    if why:
        raise UsageError(f"{package} {why}.", "Choose another --package.")
    shutil.copytree(_TEMPLATE, folder, ignore=_NOT_COPIED, dirs_exist_ok=True)
    if package:
        package_edits.rename(old, package)(folder)
        for path in folder.rglob("*.py"):
            path.write_text(_IMPORTS.sub(_by_module, path.read_text(encoding="utf-8")), encoding="utf-8")
    return load(folder)


def _by_module(imports: re.Match[str]) -> str:
    """Return lines of imports in the order that ament_flake8 asks for."""
    return "".join(sorted(imports[0].splitlines(keepends=True), key=lambda line: line.split()[1].lower()))
