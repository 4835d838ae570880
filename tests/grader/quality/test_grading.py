"""Q and I2 in whole gradings: real builds, the running graph, the demonstration against real nodes."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest
from helpers.quality_examples import REFERENCE, Change, reference

from grader import KIT, building, pipeline
from grader.report import data
from grader.scoring import rubric

pytestmark = [pytest.mark.ros, pytest.mark.sandbox, pytest.mark.slow]  # gradings with all linters

RUBRIC = KIT / "rubric.yaml"
QUALITY = ("Q1", "Q2", "Q3", "Q4", "Q5", "Q6", "I2")
DEMO = "scripts/demo.py"

Grade = Callable[..., dict[str, Any]]


@pytest.fixture
def grade(tmp_path: Path) -> Grade:
    """Grade the reference with changes; return the requirements of the report by their ids."""

    def run(
        *changes: Change, files: Mapping[str, str | bytes | None] | None = None, only: tuple[str, ...] = QUALITY
    ) -> dict[str, Any]:
        package = reference(tmp_path, *changes, files=files)
        settings = pipeline.Settings(rubric.load(RUBRIC), building.cache_folder(), requirements=only)
        report = json.loads(data.as_json(pipeline.grade(package, tmp_path / "out", settings)))
        assert report["complete"]
        return {entry["id"]: entry for entry in report["requirements"]}

    return run


def test_a_package_that_does_not_build_is_still_read(grade: Grade):
    report = grade(("CMakeLists.txt", '"msg/SensorFusionData.msg"', '"msg/FusedData.msg"'))
    assert [report[name]["points"] for name in ("Q1", "Q2", "Q3", "Q4", "Q5", "I2")] == [5, 5, 5, 4, 3, 2]
    assert report["Q6"]["points"] == 1  # the report of the tests is there; the demonstration cannot run


def test_a_demonstration_that_listens_to_the_second_node_gets_full_marks(grade: Grade):
    """Another good way: it waits for fused data, which come only while both nodes and the sensors run."""
    text = (REFERENCE / DEMO).read_text()
    text = text.replace("from ros2_robot_controller.srv import", "from ros2_robot_controller.msg import SensorFusionData\nfrom ros2_robot_controller.srv import")  # fmt: skip  # noqa: E501
    wait = "        fused = Future()\n        self.create_subscription(SensorFusionData, 'sensor_fusion_data', fused.set_result, 1)\n        self.get_logger().info(f'battery {self.wait_for(fused, \"fused data\").battery_level}')\n"  # noqa: E501
    head = "        for speed in (SPEED_MPS, TOO_FAST_MPS, 0.0):\n"
    report = grade(files={DEMO: text.replace(head, wait + head)}, only=("Q6",))
    assert report["Q6"]["points"] == 3, json.dumps(report["Q6"])
