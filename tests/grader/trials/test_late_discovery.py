"""What a node offers is waited for until it has been discovered; a node that is deaf is not waited for."""

from __future__ import annotations

from pathlib import Path

import pytest
from helpers.short_nodes import COMMANDS, ODOMETRY, Run

from grader.evidence import Kind

pytestmark = [pytest.mark.ros, pytest.mark.sandbox, pytest.mark.slow]  # a node for each, and one hangs for 10 s

DISTANCE = 'node.create_publisher(Float32, "obstacle_distance", 10)'


def test_a_service_that_is_discovered_late_is_called(run: Run):
    late = 'late(lambda: node.create_service(SetSpeed, "set_speed", answer))'
    found = run("slow_robot", COMMANDS + ODOMETRY + late)
    assert [(call.service, call.problem) for call in found.calls] == [("set_speed", None)] * 2


def test_an_action_that_is_discovered_late_gets_its_goal(run: Run):
    late = 'late(lambda: ActionServer(node, NavigateToPosition, "navigate_to_position", go))'
    (goal,) = run("cancel_early", COMMANDS + ODOMETRY + late).goals
    assert (goal.problem, goal.status, goal.success) == (None, "succeeded", True)


@pytest.mark.parametrize("quality", ["10", "qos_profile_sensor_data"])
def test_a_topic_that_is_discovered_late_is_heard_from_its_first_message(run: Run, quality: str):
    """One that is published best effort, too: F12 and F13 once lost 3.5 points, for no message at all."""
    body = f"""
from rclpy.qos import qos_profile_sensor_data
fused = []
def create():
    fused.append(node.create_publisher(SensorFusionData, "sensor_fusion_data", {quality}))
late(create)
node.create_timer(0.1, lambda: fused and fused[0].publish(SensorFusionData(battery_level=1.0)))
"""
    found = run("slow_fusion", body)
    assert [round(message.t, 2) for message in found.messages][:3] == [0.1, 0.2, 0.3]


@pytest.mark.parametrize(
    ("trial", "body", "topic"),
    [
        ("idle_robot_controller", COMMANDS + f"late(lambda: {ODOMETRY.strip()})", "odom"),
        ("idle_sensor_processor", f"late(lambda: {DISTANCE})", "obstacle_distance"),
    ],
)  # fmt: skip
def test_a_topic_that_is_discovered_late_is_on_the_recorded_graph(run: Run, trial: str, body: str, topic: str):
    graph = run(trial, body).graph
    assert graph is not None
    assert topic in {endpoint.topic for endpoint in graph.endpoints}


def test_parameter_services_that_are_discovered_late_are_asked(run: Run):
    body = COMMANDS + ODOMETRY + 'node.declare_parameter("max_linear_speed", 0.5)\nlate(lambda: ParameterService(node))'
    (answer,) = run("senseless_start_robot_controller", body, services=False).parameters
    assert answer.value == -1.0


@pytest.mark.parametrize("hang", ["while True: pass", "time.sleep(1000)"])
def test_a_node_that_hangs_in_a_callback_ends_its_trial_and_is_told_so(run: Run, hang: str):
    """It took 120 s of wall time for each such trial."""
    body = f"{COMMANDS}{ODOMETRY}def go(handle):\n    {hang}\n"
    found = run("navigate_ahead", body + 'ActionServer(node, NavigateToPosition, "navigate_to_position", go)')
    assert found.ended is not None
    assert found.ended.kind is Kind.HANGS
    assert found.ended.place.startswith("ros2_robot_controller/")
    assert found.ended.place.endswith(", in `go`")


@pytest.mark.parametrize(("more", "deaf"), [("", True), ("# MultiThreadedExecutor", False)])
def test_a_node_that_only_publishes_is_deaf_if_it_has_one_thread(run: Run, tmp_path: Path, more: str, deaf: bool):
    """An action that drives and sleeps in a loop of its own was watched for 120 s. Other threads might still hear."""
    package = tmp_path / "package"
    package.mkdir()
    (package / "node.py").write_text(f"import rclpy  {more}\n")
    body = f"""{COMMANDS}{ODOMETRY}
def go(handle):
    end = time.time() + 20
    while time.time() < end:
        time.sleep(0.05)
        commands.publish(Twist())
    handle.succeed()
    return NavigateToPosition.Result(success=True)
"""
    found = run(
        "navigate_ahead", body + 'ActionServer(node, NavigateToPosition, "navigate_to_position", go)', package=package
    )
    assert (found.ended is not None and found.ended.kind is Kind.HANGS and found.ended.place != "") is deaf


def test_a_node_that_hangs_for_five_seconds_is_waited_for(run: Run):
    body = (
        f"{COMMANDS}{ODOMETRY}def slow(request, response):\n    time.sleep(5.0)\n    return answer(request, response)\n"
        'node.create_service(SetSpeed, "set_speed", slow)'
    )
    found = run("slow_robot", body)
    assert found.ended is None
