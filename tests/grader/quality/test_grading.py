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


def test_the_reference_has_25_of_25_and_2_of_2(grade: Grade):
    report = grade()
    assert {name: report[name]["points"] for name in QUALITY} == dict(zip(QUALITY, (5, 5, 5, 4, 3, 3, 2), strict=True))


def test_a_package_that_does_not_build_is_still_read(grade: Grade):
    report = grade(("CMakeLists.txt", '"msg/SensorFusionData.msg"', '"msg/FusedData.msg"'))
    assert [report[name]["points"] for name in ("Q1", "Q2", "Q3", "Q4", "Q5", "I2")] == [5, 5, 5, 4, 3, 2]
    assert report["Q6"]["points"] == 1  # the report of the tests is there; the demonstration cannot run


def test_a_demonstration_that_ends_at_once_gets_nothing(grade: Grade):
    """Blatant."""
    report = grade(files={DEMO: "import sys\n\nsys.exit(0)\n"}, only=("Q6",))
    assert report["Q6"]["points"] == 1
    assert "it called none of set_speed, get_status" in json.dumps(report["Q6"])


def test_a_demonstration_with_a_wrong_name_shows_its_last_output(grade: Grade):
    """Blatant: no node offers the service."""
    text = (REFERENCE / DEMO).read_text().replace("'set_speed'", "'speed'").replace("ANSWER_S = 10.0", "ANSWER_S = 1.0")
    report = grade(files={DEMO: text}, only=("Q6",))
    assert report["Q6"]["points"] == 1
    assert "No node offers" in json.dumps(report["Q6"])


def test_a_demonstration_without_the_action_loses_half_a_point(grade: Grade):
    """Subtle: it runs, drives by the service, says so, and exits 0."""
    text = (REFERENCE / DEMO).read_text()
    lines = [line for line in text.splitlines(keepends=True) if "self.finish(handle)" not in line and "handle = self.send_goal" not in line]  # fmt: skip  # noqa: E501
    report = grade(files={DEMO: "".join(lines)}, only=("Q6",))
    assert report["Q6"]["points"] == 2.5
    assert "it sent no goal" in json.dumps(report["Q6"])


def test_a_demonstration_that_fails_at_the_end_loses_a_point(grade: Grade):
    """Subtle: it shows everything and exits with a status other than 0."""
    report = grade(
        (DEMO, "        rclpy.try_shutdown()\n    return 0\n", "        rclpy.try_shutdown()\n    return 3\n"),
        only=("Q6",),
    )
    assert report["Q6"]["points"] == 2
    assert "exit status 3" in json.dumps(report["Q6"])


def test_a_demonstration_that_listens_to_the_second_node_gets_full_marks(grade: Grade):
    """Another good way: it waits for fused data, which come only while both nodes and the sensors run."""
    text = (REFERENCE / DEMO).read_text()
    text = text.replace("from ros2_robot_controller.srv import", "from ros2_robot_controller.msg import SensorFusionData\nfrom ros2_robot_controller.srv import")  # fmt: skip  # noqa: E501
    wait = "        fused = Future()\n        self.create_subscription(SensorFusionData, 'sensor_fusion_data', fused.set_result, 1)\n        self.get_logger().info(f'battery {self.wait_for(fused, \"fused data\").battery_level}')\n"  # noqa: E501
    head = "        for speed in (SPEED_MPS, TOO_FAST_MPS, 0.0):\n"
    report = grade(files={DEMO: text.replace(head, wait + head)}, only=("Q6",))
    assert report["Q6"]["points"] == 3, json.dumps(report["Q6"])
