"""What a worker reports is data: no byte of it stops the grader. The worker's files are made up here."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from helpers.course import NODES

from grader.student_tests import worker_report

HERE = "/ws/package/ros2_robot_controller/a.py"


@pytest.mark.parametrize("line", ["²", "1" * 5000, "-1", "1e3", "", " 1", "٣"])
def test_a_line_that_is_not_a_number_is_left_out(line: str):
    text = json.dumps({"tests": ["t"], "reach": {HERE: {line: [0], "7": [0]}}})
    assert worker_report._reach(json.loads(text)) == {"ros2_robot_controller/a.py": {7: frozenset({"t"})}}


@pytest.mark.parametrize(
    "text", ["[" * 100000, '{"status": ' + "9" * 5000 + "}", "[1]", '"x"', "", '{"status": NaN}', '{"status": 1e999}']
)
def test_malformed_files_read_as_nothing(tmp_path: Path, text: str):
    for end in ("done", "report", "reach"):
        (tmp_path / f"0.{end}").write_text(text)
    ran = worker_report.read_run(tmp_path, 0, 1.0)
    assert (ran.tests, ran.finished, ran.status, ran.reach) == ((), False, -1, {})


@pytest.mark.parametrize("entry", [{"queued": float("nan")}, {"queued": "x"}, {"queued": 10**400}, {"queued": [[]]}])
def test_a_malformed_waiting_time_counts_as_none(tmp_path: Path, entry: dict[str, object]):
    (tmp_path / "0.done").write_text(json.dumps({"status": 0, **entry}))
    assert worker_report.read_run(tmp_path, 0, 1.0).quiet_seconds == 1.0


@pytest.mark.parametrize(
    ("command", "nodes"),
    [
        ("ros2 run ros2_robot_controller robot_controller --ros-args -p use_sim_time:=true", ["robot_controller"]),
        ("/ws/install/lib/ros2_robot_controller/sensor_processor", ["sensor_processor"]),
        ("python3 -m ros2_robot_controller.sensor_processor", ["sensor_processor"]),
        ("bash -c ros2 launch ros2_robot_controller robot_controller_launch.py", ["robot_controller"]),
        ("ros2 topic echo /scan", []),
        ("echo robot_controller", []),
        ("", []),
    ],
)
def test_a_started_node_is_told_by_its_command_line(command: str, nodes: list[str]):
    assert list(worker_report.started_nodes(command, NODES)) == nodes
