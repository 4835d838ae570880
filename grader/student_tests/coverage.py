"""Combine what coverage measured of all test modules. Done in a sandbox too: the data come from the submission."""

from __future__ import annotations

import ast
import posixpath
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from grader import building, sandbox
from grader.evidence import FileCoverage
from grader.host import ros_env
from grader.python_ast import first_line, parse
from grader.sandbox import untrusted
from grader.student_tests import package_modules
from grader.student_tests.coverage_exclusions import guarded_lines
from grader.student_tests.package_modules import PACKAGE
from grader.student_tests.worker_report import ModuleRun

_SCRIPT = """
from coverage.cmdline import main
main(["combine", "-q", "--rcfile=/ws/coveragerc"])
main(["json", "-q", "--rcfile=/ws/coveragerc", "-o", "/ws/out/all.json"])
"""


def combine(
    package: Path,
    install: Path,
    folder: Path,
    runs: Sequence[ModuleRun],
    texts: Mapping[str, str],
    unreached: Mapping[str, frozenset[int]],
) -> tuple[list[FileCoverage], list[str]]:
    """Return what all modules together reached, and the reasons to doubt it.

    Args:
        package: the package as handed in; its sources say which lines exist, not copies that a test has changed.
        install: the install tree.
        folder: the worker's folder, with its coverage settings.
        runs: the runs whose data count.
        texts: the modules that the grader can read and replace, by path. What was reached of any other cannot be
            checked against a run of known result, so none of it counts as reached.
        unreached: the lines of each that no node can come to: that tests reach them counts for nothing.
    """
    kept = [run.coverage_data for run in runs if run.coverage_data is not None and run.coverage_data.is_file()]
    if not kept:
        return [], []
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
        found, doubts = [], []
        for name, data in sorted(files.items()):
            inside = _inside(name)
            text = texts.get(inside)
            # Python can run some modules that it cannot parse into a tree.
            if text is None or parse(text) is None:
                found.append(_unreached(_file(name, data, set(), frozenset()), data))
                continue
            found.append(_file(name, data, guarded_lines(text), unreached.get(inside, frozenset())))
            doubts += unexplained(inside, text, data["executed_lines"], [run.reach.get(inside, {}) for run in runs])
    except (ValueError, KeyError, TypeError, AttributeError, IndexError, OverflowError, RecursionError, MemoryError):
        return [], []
    return found, doubts


def unexplained(
    path: str, text: str, reached: Sequence[int], reach: Sequence[Mapping[int, frozenset[str]]]
) -> list[str]:
    """Return the first line that is in coverage's data and in no run's report, as a sentence; [] if there is none.

    A statement of several lines may be reported by any of them.
    """
    known = {line for lines in reach for line in lines}
    tree = parse(text)
    spans = list(_spans(tree)) if tree else []
    for line in sorted(set(reached) - known):
        around = [range(first, last + 1) for first, last in spans if first <= line <= last]
        if around and not any(known & set(span) for span in around):
            return [f"{path}: line {line} is in coverage's data, yet no test was reported to reach it"]
    return []


def _spans(tree: ast.Module) -> Iterator[tuple[int, int]]:
    """Yield the first and last line of each statement, without the statements in it."""
    for node in ast.walk(tree):
        if isinstance(node, ast.stmt):
            body = getattr(node, "body", None)
            last = max(node.lineno, body[0].lineno - 1) if body else (node.end_lineno or node.lineno)
            yield first_line(node), last


def _unreached(file: FileCoverage, data: Mapping[str, Any]) -> FileCoverage:
    missing = sorted(int(line) for kind in ("executed", "missing") for line in data[f"{kind}_lines"])
    return replace(file, lines_hit=0, branches_hit=0, missing=missing[:500])


def _inside(name: str) -> str:
    """Return a file's path relative to the package, wherever it was measured; relative to / for any other file."""
    path = Path(posixpath.normpath(posixpath.join("/ws/out", name)))
    return package_modules.relative(path) or str(path.relative_to("/"))


def _file(name: str, data: Mapping[str, Any], guarded: set[int], unreached: frozenset[int]) -> FileCoverage:
    """Return a file's figures without the lines that no test can be expected to reach, and what is hit for nothing."""
    summary = data["summary"]
    hit, missing = ([int(line) for line in data[f"{kind}_lines"]] for kind in ("executed", "missing"))
    taken, left = ([int(branch[0]) for branch in data[f"{kind}_branches"]] for kind in ("executed", "missing"))
    # What was missed stays in: no node seems to come to it, but a node may.
    hit_out, taken_out = {*hit} & (guarded | unreached), sum(line in guarded | unreached for line in taken)
    left_out = sum(line in guarded for line in left)
    return FileCoverage(
        path=name.encode("utf-8", "replace").decode().removeprefix("../").removeprefix("/ws/")
        .removeprefix("package/")[:200],
        lines=int(summary["num_statements"]) - len(hit_out | ({*missing} & guarded)),
        lines_hit=int(summary["covered_lines"]) - len(hit_out),
        branches=int(summary["num_branches"]) - taken_out - left_out,
        branches_hit=int(summary["covered_branches"]) - taken_out,
        missing=[line for line in missing if line not in guarded][:500],
        padding=len({*hit} & unreached),
    )  # fmt: skip
