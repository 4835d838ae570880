"""Change one thing in the reference, read it in this process, and run a check on the facts."""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path
from unittest.mock import patch

from grader import KIT, evidence
from grader.checks import judge
from grader.checks.measured import Measured
from grader.course import Course, role
from grader.quality import parsed_module, source, source_files, worker
from grader.quality.manifest import read_manifest
from grader.quality.package_sources import read_sources
from helpers.course import COURSE
from helpers.judging import Check, Judged, ask, evidence_with

REFERENCE = KIT / "solution_pkg" / "ros2_robot_controller"
CONTROLLER = "ros2_robot_controller/robot_controller.py"
DRIVER = "ros2_robot_controller/driver.py"
NAVIGATOR = "ros2_robot_controller/navigator.py"
PROCESSOR = "ros2_robot_controller/sensor_processor.py"
CONVERSIONS = "ros2_robot_controller/utils/conversions.py"
MOTION = "ros2_robot_controller/utils/motion.py"

Change = tuple[str, str, str]


def reference(folder: Path, *changes: Change, files: Mapping[str, str | bytes | None] | None = None) -> Path:
    """Copy the reference below `folder`, replace texts (file, old, new), write or remove files."""
    package = folder / REFERENCE.name
    shutil.copytree(REFERENCE, package, ignore=shutil.ignore_patterns("__pycache__", ".pytest_cache"))
    for file, old, new in changes:
        text = (package / file).read_text()
        assert text.count(old) == 1, f"{old!r} occurs {text.count(old)} times in {file}, not once"
        (package / file).write_text(text.replace(old, new))
    return written(package, files or {})


def written(package: Path, files: Mapping[str, str | bytes | None]) -> Path:
    """Write files below `package`; None removes one."""
    for name, content in files.items():
        path = package / name
        if content is None:
            path.unlink()
            continue
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return package


def facts(package: Path, beside: Path | None = None, *, tests: bool = False, lint: bool = False) -> evidence.Quality:
    """Return what the worker finds in a package, in this process.

    The modules in test/ are half of the reference and matter to few checks, so they are left out by default.
    """
    found = [
        (source.path, str(package / source.path))
        for source in source_files.find(package, COURSE)
        if not source.problem and (tests or not source.path.startswith("test/"))
    ]
    with patch.object(worker, "parse", parsed):
        return worker.package_facts(package, beside, found, course=COURSE, lint=lint)


def with_manifest_of(package: Path) -> evidence.Quality:
    """Return the reference's facts with those of this package's package.xml."""
    found = [parsed(source.path, source.data, COURSE.package) for source in source_files.find(package, COURSE)]
    return replace(untouched(), manifest=read_manifest(read_sources(package, None, COURSE), found))


parsed = cache(parsed_module.parse)  # most files of the reference are the same in every test


def with_linters(package: Path) -> evidence.Quality:
    """Return everything that a grading collects, in a process of its own."""
    return source.analyse_package(package, COURSE)


@cache
def untouched() -> evidence.Quality:
    """Return the facts of the unchanged reference, linters included, read once."""
    return with_linters(REFERENCE)


def judged(check: Check, quality: evidence.Quality | None, **more: object) -> Judged:
    """Return the result of `check` on this quality; `more` are other facts of the evidence.

    Most examples are a few lines and no node. They are judged as if the nodes were there and ran all of them.
    """
    with patch.object(judge, "measure", _as_if_all_ran):
        return as_it_is(check, quality, **more)


class _All(Measured):
    def covers(self, *_: object) -> bool:
        return True


def _as_if_all_ran(found: evidence.Evidence, course: Course) -> Measured:
    files = found.quality.files if found.quality is not None else []
    whole = frozenset(file.path for file in files if role(file.path, course.package) in ("module", "script"))
    return _All(whole=whole, of_node=dict.fromkeys(course.nodes, whole))


def as_it_is(check: Check, quality: evidence.Quality | None, **more: object) -> Judged:
    """Return the result of `check` on this quality, with or without nodes."""
    return ask(check, evidence_with(quality=quality, **more))
