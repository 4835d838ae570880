"""A slip in an interface costs what it costs, is named with its field, and is graded to its end."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from helpers.course import CONTRACT
from submissions.edits import REFERENCE

from grader import pipeline
from grader.course import definition
from grader.intake import package_edits
from grader.scoring.scorecard import Outcome

SLIPS = [
    ("srv/SetSpeed.srv", "float32 speed", "float64 speed", "F2 F3 I3 I4 Q6"),
    ("srv/GetRobotStatus.srv", "string status", "string[] status", "F7 I3 I4 Q6"),
    ("action/NavigateToPosition.action", "float32 tolerance", "float32 the_tolerance", "F8 F9 I3 I4 Q6"),
    ("msg/SensorFusionData.msg", "float32 battery_level", "int16 battery_level", "F12 F13 I3 I4"),
]


@pytest.mark.parametrize(("file", "old", "new", "asked"), SLIPS)
def test_a_slip_is_named_with_its_field(file: str, old: str, new: str, asked: str):
    wanted = (CONTRACT / file).read_text()
    ((_, said),) = definition.differences(file.partition("/")[0], wanted.replace(old, new), wanted)
    assert said == f"`{new}` should be `{old}`"


@pytest.mark.ros
@pytest.mark.sandbox
@pytest.mark.slow  # a build and a grading for each slip
@pytest.mark.parametrize(("file", "old", "new", "asked"), SLIPS)
def test_a_slip_is_graded_to_its_end(
    file: str, old: str, new: str, asked: str, settings: pipeline.Settings, tmp_path: Path
):
    """`float64 speed` for `float32 speed` ended the grading: "killed from outside, as when memory runs out"."""
    package = package_edits.copy(REFERENCE, tmp_path)
    package_edits.replace(file, old, new)(package)
    grading = pipeline.grade(package, tmp_path / "out", replace(settings, requirements=tuple(asked.split())))
    assert grading.evidence.build.ok
    judged = {score.requirement.id: score for score in grading.scorecard.requirements}
    assert [name for name in asked.split() if judged[name].outcome is Outcome.ERROR] == []
    assert judged["I3"].points < judged["I3"].max
