"""Padding: code that the package's tests run and no node can come to. It says nothing about the nodes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path

from grader.building import installed_code
from grader.course import Course
from grader.evidence import Flag
from grader.host import ros_env
from grader.quality.reachability import Reachability, reachability
from grader.student_tests import package_modules
from grader.student_tests.canary import Reach

_FLAGGED_LINES = 30  # a helper that its author has forgotten is shorter
_FLAGGED_SHARE = 0.2  # of the lines that the tests run


def code_of(package: Path, install: Path, course: Course) -> Reachability:
    """Return what the nodes can come to in the package's modules as they are installed.

    Where there is no node yet, nothing is called unreached.
    """
    texts = package_modules.texts(package, install)
    site = str(ros_env.SITE_IN_PREFIX)
    programs = installed_code.python_texts(install, course.nodes)
    started = {path: text for path, text in programs if not path.startswith(site)}
    modules = {path: text for path, text in texts.items() if text is not None}
    found = reachability(package, modules, started, course=course)
    return found if found.homes else replace(found, unreached={})


def padding(code: Reachability, reaches: Iterable[Reach]) -> dict[str, frozenset[int]]:
    """Return the lines of each module that tests run and no node can come to.

    What neither of them reaches is no padding: if the nodes do come to it in a way that cannot be seen, hiding it
    must not pay.
    """
    found: dict[str, set[int]] = {}
    for reach in reaches:
        for path in reach.keys() & code.unreached.keys():
            found.setdefault(path, set()).update(reach[path].keys() & code.unreached[path])
    return {path: frozenset(lines) for path, lines in found.items() if lines}


def padding_flags(found: Mapping[str, frozenset[int]], reaches: Iterable[Reach]) -> list[Flag]:
    """Return a flag if much of what the tests run is padding."""
    lines = sum(map(len, found.values()))
    run = {(path, line) for reach in reaches for path, by_line in reach.items() for line in by_line}
    if lines < max(_FLAGGED_LINES, _FLAGGED_SHARE * len(run)):
        return []
    path = max(found, key=lambda path: len(found[path]))
    words = f"tests run {lines} lines that no node can come to, of {len(run)} in all; they do not count"
    return [Flag("padding", words, where=path)]
