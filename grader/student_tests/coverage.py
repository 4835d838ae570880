"""Combine what coverage measured of all test modules. Done in a sandbox too: the data come from the submission."""

from __future__ import annotations

import posixpath
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from grader import building, sandbox
from grader.evidence import FileCoverage
from grader.host import ros_env
from grader.python_ast import TOO_COMPLEX, is_guard, parse
from grader.sandbox import untrusted
from grader.student_tests import package_modules
from grader.student_tests.package_modules import PACKAGE
from grader.student_tests.worker_report import ModuleRun

_SCRIPT = """
from coverage.cmdline import main
main(["combine", "-q", "--rcfile=/ws/coveragerc"])
main(["json", "-q", "--rcfile=/ws/coveragerc", "-o", "/ws/out/all.json"])
"""


def combine(
    package: Path, install: Path, folder: Path, runs: Sequence[ModuleRun], texts: Mapping[str, str | None]
) -> list[FileCoverage]:
    """Return what all modules together reached.

    Args:
        package: the package as handed in; its sources say which lines exist, not copies that a test has changed.
        install: the install tree.
        folder: the worker's folder, with its coverage settings.
        runs: the runs whose data count.
        texts: the package's modules by path.
    """
    kept = [run.coverage_data for run in runs if run.coverage_data is not None and run.coverage_data.is_file()]
    if not kept:
        return []
    out = folder / "combined"
    out.mkdir()
    for number, path in enumerate(kept):  # several workers may have measured, each with numbers of its own
        path.rename(out / f"coverage.{number}")
    box = sandbox.Sandbox(
        read_only={install: str(building.INSTALL), folder / "coveragerc": "/ws/coveragerc", package: str(PACKAGE)},
        writable={out: "/ws/out"},
        environment=ros_env.environment(home=sandbox.HOME),
        cwd="/ws/out",
    )
    sandbox.run(["python3", "-c", _SCRIPT], box)
    try:
        files = (untrusted.read_json(out / "all.json") or {}).get("files", {})
        by_path = sorted((_inside(name), data) for name, data in files.items())
        return [_file(path, data, guarded_lines(texts.get(path) or "")) for path, data in by_path]
    except (ValueError, KeyError, TypeError, AttributeError, IndexError, OverflowError, RecursionError, MemoryError):
        return []


def _inside(name: str) -> str:
    """Return a file's path relative to the package, wherever it was measured; relative to / for any other file."""
    path = Path(posixpath.normpath(posixpath.join("/ws/out", name)))
    return package_modules.relative(path) or str(path.relative_to("/"))


def _file(path: str, data: dict[str, Any], guarded: set[int]) -> FileCoverage:
    """Return a file's figures without the lines that no test can be expected to reach."""
    summary = data["summary"]
    hit, missing = ([int(line) for line in data[f"{kind}_lines"]] for kind in ("executed", "missing"))
    taken, left = ([int(branch[0]) for branch in data[f"{kind}_branches"]] for kind in ("executed", "missing"))
    taken_out = sum(line in guarded for line in taken)
    return FileCoverage(
        path=path.encode("utf-8", "replace").decode()[:200],
        lines=int(summary["num_statements"]) - len(guarded.intersection([*hit, *missing])),
        lines_hit=int(summary["covered_lines"]) - len(guarded.intersection(hit)),
        branches=int(summary["num_branches"]) - taken_out - sum(line in guarded for line in left),
        branches_hit=int(summary["covered_branches"]) - taken_out,
        missing=[line for line in missing if line not in guarded][:500],
    )


def guarded_lines(text: str) -> set[int]:
    """Return the lines of a module's guards; only those at its top level count."""
    tree = parse(text)
    try:
        guards = [statement for statement in tree.body if is_guard(statement)] if tree else []
    except TOO_COMPLEX:  # a condition that can be parsed and not written out
        return set()
    return {line for guard in guards for line in range(guard.lineno, (guard.end_lineno or guard.lineno) + 1)}
