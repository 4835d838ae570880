"""Put together what coverage measured of all modules. Done behind a wall too: the data are the submission's."""

from __future__ import annotations

import ast
import posixpath
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from grader import build, sandbox
from grader.evidence import FileCoverage
from grader.host import ros_env
from grader.python_ast import parse
from grader.sandbox import untrusted
from grader.student_tests.coverage_exclusions import guarded_lines
from grader.student_tests.warm_worker import MODULES, PACKAGE, Ran

_SCRIPT = "coverage combine -q --rcfile=/ws/coveragerc; coverage json -q --rcfile=/ws/coveragerc -o /ws/out/all.json"


def combine(
    package: Path, install: Path, room: Path, measured: Sequence[Ran], texts: Mapping[str, str]
) -> tuple[list[FileCoverage], list[str]]:
    """Return what all modules together reached, and what makes that doubtful.

    Args:
        package: the package as handed in; its sources say which lines there are, not those that a test left behind.
        install: the install tree.
        room: the folder of the bench, with its coverage settings.
        measured: the runs whose data count.
        texts: the modules that the grader can read and replace, by path. Of any other, what was reached cannot be held
            against a run of known result, so nothing of it counts as reached.
    """
    kept = [ran.data for ran in measured if ran.data is not None and ran.data.is_file()]
    if not kept:
        return [], []
    out = room / "combined"
    out.mkdir()
    for path in kept:
        path.rename(out / path.name)
    box = sandbox.Sandbox(
        read_only={install: str(build.INSTALL), room / "coveragerc": "/ws/coveragerc", package: str(PACKAGE)},
        writable={out: "/ws/out"},
        environment=ros_env.environment(home=sandbox.HOME),
        cwd="/ws/out",
    )
    sandbox.run(["sh", "-c", _SCRIPT], box)
    try:
        files = (untrusted.read_json(out / "all.json") or {}).get("files", {})
        found, doubts = [], []
        for name, data in sorted(files.items()):
            inside = _inside(name)
            text = texts.get(inside)
            if text is None or parse(text) is None:  # Python can run some modules that it cannot parse into a tree
                found.append(_file(name, _with_nothing_reached(data), set()))
                continue
            found.append(_file(name, data, guarded_lines(text)))
            doubts += unexplained(inside, text, data["executed_lines"], [ran.reach.get(inside, {}) for ran in measured])
    except (ValueError, KeyError, TypeError, AttributeError, IndexError, OverflowError, RecursionError, MemoryError):
        return [], []
    return found, doubts


def unexplained(
    path: str, text: str, reached: Sequence[int], reach: Sequence[Mapping[int, frozenset[str]]]
) -> list[str]:
    """Return what is wrong with lines that coverage's data has and no run has reported, nothing if there are none.

    A statement of several lines may be told by any of them.
    """
    known = {line for lines in reach for line in lines}
    strange = sorted(set(reached) - known)
    if not strange:
        return []
    spans = list(_spans(text))
    for line in strange:
        around = [range(first, last + 1) for first, last in spans if first <= line <= last]
        if around and not any(known & set(span) for span in around):
            return [f"{path}: line {line} is in coverage's data, yet no test was reported to reach it"]
    return []


def _spans(text: str) -> Iterator[tuple[int, int]]:
    """Yield the first and last line of each statement, without the statements in it."""
    for node in ast.walk(parse(text) or ast.Module([], [])):
        if isinstance(node, ast.stmt):
            decorators = [d.lineno for d in getattr(node, "decorator_list", ())]
            body = getattr(node, "body", None)
            last = max(node.lineno, body[0].lineno - 1) if body else (node.end_lineno or node.lineno)
            yield min([node.lineno, *decorators]), last


def _with_nothing_reached(data: Mapping[str, Any]) -> dict[str, Any]:
    return {
        "summary": {**data["summary"], "covered_lines": 0, "covered_branches": 0},
        "executed_lines": [],
        "missing_lines": sorted([*data["executed_lines"], *data["missing_lines"]]),
        "executed_branches": [],
        "missing_branches": [*data["executed_branches"], *data["missing_branches"]],
    }


def _inside(name: str) -> str:
    """Return a file's path relative to the package, wherever it was measured."""
    path = Path(posixpath.normpath(posixpath.join("/ws/out", name)))
    root = next((root for root in (PACKAGE, MODULES.parent) if path.is_relative_to(root)), Path("/"))
    return str(path.relative_to(root))


def _file(name: str, data: Mapping[str, Any], guarded: set[int]) -> FileCoverage:
    """Return a file's figures without the lines that no test can be asked to reach."""
    summary = data["summary"]
    hit, missing = (_lines(data[f"{kind}_lines"]) for kind in ("executed", "missing"))
    taken, left = ([int(branch[0]) for branch in data[f"{kind}_branches"]] for kind in ("executed", "missing"))
    out = sum(line in guarded for line in taken), sum(line in guarded for line in left)
    return FileCoverage(
        path=name.encode("utf-8", "replace").decode().removeprefix("../").removeprefix("/ws/")
        .removeprefix("package/")[:200],
        lines=int(summary["num_statements"]) - len({*hit, *missing} & guarded),
        lines_hit=int(summary["covered_lines"]) - len({*hit} & guarded),
        branches=int(summary["num_branches"]) - sum(out),
        branches_hit=int(summary["covered_branches"]) - out[0],
        missing=[line for line in missing if line not in guarded][:500],
    )  # fmt: skip


def _lines(found: Sequence[Any]) -> list[int]:
    return [int(line) for line in found]
