"""The kit's own course, for tests of the engine that grade its packages."""

from __future__ import annotations

import shutil
from pathlib import Path

from grader.course import kits_own

COURSE = kits_own()
PACKAGE, INTERFACES_PACKAGE = COURSE.package, COURSE.interfaces_package
REFERENCE = COURSE.solution
LAYOUT, CONTRACT, INTERFACES = COURSE.layout, COURSE.contract, COURSE.interfaces
NODES = tuple(COURSE.nodes)
NODE_TESTS, LAUNCH_FILES = tuple(node.test for node in COURSE.nodes.values()), tuple(COURSE.launch)
PARAMETERS = {name: node.defaults for name, node in COURSE.nodes.items()}


def copied(folder: Path, rubric: str = "", more: str = "") -> Path:
    """Copy the course to a folder, with another rubric if one is given and `more` lines of course.yaml."""
    shutil.copytree(COURSE.folder, folder, ignore=shutil.ignore_patterns("__pycache__"))
    (folder / "rubric.yaml").write_text(rubric or COURSE.rubric.read_text())
    places = f"rubric: rubric.yaml\nsolution: {COURSE.solution}\nnotebooks: {COURSE.notebooks}\n"
    (folder / "course.yaml").write_text(f"title: A copy\npackage: {PACKAGE}\n{places}{more}")
    return folder
