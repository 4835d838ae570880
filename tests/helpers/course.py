"""The kit's own course, for tests of the engine that grade its packages."""

from __future__ import annotations

from grader.course import kits_own, role

COURSE = kits_own()
PACKAGE, INTERFACES_PACKAGE = COURSE.package, COURSE.interfaces_package
REFERENCE = COURSE.solution
LAYOUT, CONTRACT, INTERFACES = COURSE.layout, COURSE.contract, COURSE.interfaces
NODES = tuple(COURSE.nodes)
NODE_TESTS, LAUNCH_FILES = tuple(node.test for node in COURSE.nodes.values()), tuple(COURSE.launch)
PARAMETERS = {name: node.defaults for name, node in COURSE.nodes.items()}


def role_of(path: str) -> str:
    """Return what a file of the course's package is for."""
    return role(path, PACKAGE)
