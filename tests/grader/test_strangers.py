"""Whole solutions by authors who had read only the handout, as they were handed in.

They chose other ways than the reference: CMake writes the nodes' launchers (`launchers_by_cmake`) or configures them
(`many_threads`, a MultiThreadedExecutor with blocking callbacks), and an ament_python package has its interfaces beside
it (`ament_python_and_interfaces`).
"""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from submissions.reports import words

from grader import KIT, pipeline
from grader.report import data

pytestmark = [pytest.mark.ros, pytest.mark.sandbox, pytest.mark.slow]  # a whole grading each

LOSES = {
    "launchers_by_cmake": {},
    "ament_python_and_interfaces": {"I3": 2.0},  # the types' names, by the contract's own words
    "many_threads": {},
}


@pytest.mark.parametrize("name", LOSES)
def test_a_strangers_solution_loses_what_the_contract_takes_and_no_more(name: str, settings, tmp_path: Path):
    grading = pipeline.grade(KIT / "tests" / "submissions" / "strangers" / f"{name}.zip", tmp_path / "out", settings)
    report = json.loads(data.as_json(grading))
    assert report["complete"], words(report)
    lost = {r["id"]: round(r["max"] - r["points"], 2) for r in report["requirements"] if r["points"] < r["max"]}
    assert lost == LOSES[name], words(report)
