"""Gradescope: results.json of an autograder (gradescope/autograder_samples, docs/specs.md)."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from grader.classroom.exports.words import losses
from grader.classroom.gradebook import Gradebook, RequirementPoints, Row
from grader.host.atomic import write_atomically
from grader.scoring.rubric import Rubric


def write(row: Row, rubric: Rubric, report: dict[str, Any] | None, path: Path) -> None:
    """Write the results of one submission. `report` is its report.json, None if it could not be graded."""
    write_atomically(path, json.dumps(results(row, rubric, report), indent=2, allow_nan=False) + "\n")


def results(row: Row, rubric: Rubric, report: dict[str, Any] | None) -> dict[str, Any]:
    """Return what results.json says: a test for each requirement that has points."""
    measured = {each["id"]: each for each in report["requirements"]} if report and "requirements" in report else {}
    numbers = {
        requirement.id: f"{chapter}.{place}"
        for chapter, criterion in enumerate(rubric.criteria, 1)
        for place, requirement in enumerate(criterion.requirements, 1)
    }
    found: dict[str, Any] = {
        "output": row.comment or "Graded.",
        "output_format": "text",
        "test_output_format": "text",
        "visibility": "visible",
        "stdout_visibility": "hidden",
        "tests": [
            _test(each, numbers[each.id], rubric.requirement(each.id).title, measured.get(each.id, {}))
            for each in row.requirements
            if each.points is not None
        ],
        "extra_data": {"state": row.state.value, "late": row.late_units, "flags": row.flags},
    }
    # The score overrides the sum of the tests: it has the deduction for lateness.
    found["score"] = float(row.total) if row.total is not None else 0.0
    if report and isinstance(report.get("wall_seconds"), int | float):
        found["execution_time"] = round(report["wall_seconds"], 1)
    return found


def _test(each: RequirementPoints, number: str, title: str, measured: dict[str, Any]) -> dict[str, Any]:
    said = f"{each.override.points} points by {each.override.by}: {each.override.why}" if each.override else ""
    return {
        "name": f"{each.id} {title}",
        "number": number,
        "score": float(each.points or 0),
        "max_score": float(each.max),
        "status": "passed" if each.points == each.max else "failed",
        "output": "\n".join(filter(None, [said, *losses(measured)])),
        "visibility": "visible",
    }


def write_all(book: Gradebook, reports: dict[str, dict[str, Any] | None], folder: Path) -> list[Path]:
    """Write ID/results.json for each submission below `folder`, and return the paths."""
    written = []
    for row in {row.submission: row for row in book.rows if row.submission}.values():
        path = folder / row.submission / "results.json"
        write(row, book.rubric, reports.get(row.submission), path)
        written.append(path)
    return written
