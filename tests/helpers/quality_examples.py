"""The reference with one thing changed, read in this process, and a check asked about it."""

from __future__ import annotations

import importlib
import shutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from unittest.mock import patch

from grader import KIT, evidence
from grader.checks.judge import Failed, Judge, NotReached
from grader.quality import manifest, modules, source_files, worker
from grader.quality.analyse import analyse_package

REFERENCE = KIT / "solution_pkg" / "ros2_robot_controller"
CONTROLLER = "ros2_robot_controller/robot_controller.py"
DRIVER = "ros2_robot_controller/driver.py"
NAVIGATOR = "ros2_robot_controller/navigator.py"
PROCESSOR = "ros2_robot_controller/sensor_processor.py"
CONVERSIONS = "ros2_robot_controller/utils/conversions.py"
MOTION = "ros2_robot_controller/utils/motion.py"

Change = tuple[str, str, str]
Check = Callable[[Judge], None]


@dataclass(frozen=True)
class Judged:
    """What a check says: the share of its points, what it saw, and whether it could judge at all."""

    share: float
    seen: str
    try_: str = ""
    reached: bool = True


def reference(folder: Path, *changes: Change, files: Mapping[str, str | bytes | None] | None = None) -> Path:
    """Copy the reference below `folder`, replace texts (file, old, new), write or remove files."""
    package = folder / REFERENCE.name
    shutil.copytree(REFERENCE, package, ignore=shutil.ignore_patterns("__pycache__", ".pytest_cache"))
    for file, old, new in changes:
        text = (package / file).read_text()
        assert text.count(old) == 1, f"{old!r} stands {text.count(old)} times in {file}, not once"
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


def facts(package: Path, beside: Path | None = None, *, tests: bool = False) -> evidence.Quality:
    """Return what our own reader says of a package, without the linters, in this process.

    The modules in test/ are half of the reference and matter to few checks, so they are left out unless asked for.
    """
    found = [
        (source.path, str(package / source.path))
        for source in source_files.find(package)
        if not source.problem and (tests or not source.path.startswith("test/"))
    ]
    with patch.object(worker, "parse", _parsed):
        return worker.read(package, beside, found)


def with_manifest_of(package: Path) -> evidence.Quality:
    """Return the reference's facts with those of this package's package.xml."""
    found = [_parsed(source.path, source.data) for source in source_files.find(package)]
    told = manifest.read_manifest(package, source_files.package_files(package), found)
    return replace(untouched(), manifest=told)


_parsed = cache(modules.parse)  # most of the reference stays the same from test to test


def with_linters(package: Path) -> evidence.Quality:
    """Return everything, as a grading has it: three processes."""
    return analyse_package(package)


def with_flake8(package: Path) -> evidence.Quality:
    """Return what flake8 and our own reader say: one process."""
    return _without("_pep257", package)


def with_pep257(package: Path) -> evidence.Quality:
    """Return what pydocstyle and our own reader say: one process."""
    return _without("_flake8", package)


def _without(tool: str, package: Path) -> evidence.Quality:
    whole = importlib.import_module("grader.quality.analyse")
    here = (facts(package), [])
    with patch.object(whole, tool, lambda *_: []), patch.object(whole, "_facts", lambda *_: here):
        return analyse_package(package)


@cache
def untouched() -> evidence.Quality:
    """Return the reference's own facts, linters included, read once."""
    return with_linters(REFERENCE)


def judged(check: Check, quality: evidence.Quality | None, **more: object) -> Judged:
    """Return what `check` says of a grading with this quality; `more` are other facts of it."""
    grading = evidence.Evidence(
        intake=evidence.Intake("team07.zip", "", "ros2_robot_controller", "."),
        build=evidence.Build(True, True, 0.0, 0, False, ""),
        quality=quality,
    )
    judge = Judge(replace(grading, **more))  # type: ignore[arg-type]
    try:
        check(judge)
    except Failed as failed:
        return Judged(0.0, failed.seen, failed.try_)
    except NotReached as because:
        return Judged(0.0, str(because), reached=False)
    return Judged(judge.fraction, judge.seen, judge.try_)
