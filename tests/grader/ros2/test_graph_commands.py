"""The `ros2` command beside the reference nodes, in a network of their own.

The expected output was compared with that of the real ros2cli 0.32.2 beside the same nodes.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from helpers.course import COURSE
from helpers.ros2_runs import COMMAND, until

from grader import KIT, building
from grader.host import namespaces, ros_env

pytestmark = [
    pytest.mark.ros,
    pytest.mark.sandbox,
    pytest.mark.slow,  # commands that wait for discovery
    pytest.mark.skipif(shutil.which("bwrap") is None, reason="needs a network of its own: apt-get install bubblewrap"),
]
Ros2 = Callable[..., Any]
TYPE = "ros2_robot_controller"


@pytest.fixture(scope="module")
def ros2(tmp_path_factory: pytest.TempPathFactory, reference: Path) -> Iterator[Ros2]:
    """Return a function that runs the command where both reference nodes have been launched."""
    folder = tmp_path_factory.mktemp("graph")
    install = building.build([reference], building.cache_folder(), COURSE).install
    env = {**ros_env.environment(install, home=folder), "ROS2_COURSE_KIT_OWN": "1"}
    driver = subprocess.Popen(
        namespaces.private_network([sys.executable, str(KIT / "tests" / "helpers" / "netns_driver.py")]),
        env=env, cwd=folder, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert driver.stdin is not None
    assert driver.stdout is not None

    def ask(*words: str, **more: Any) -> SimpleNamespace:
        driver.stdin.write(json.dumps({"words": [sys.executable, str(COMMAND), *words], **more}) + "\n")
        driver.stdin.flush()
        return SimpleNamespace(**json.loads(driver.stdout.readline()))

    log = folder / "nodes.log"
    ask("launch", TYPE, "robot_controller_launch.py", background=str(log))
    until(lambda: log.is_file() and "is ready" in log.read_text())
    # The second prints nothing when it has started; but then it answers.
    until(lambda: ask("param", "get", "/sensor_processor", "use_sim_time").code == 0)
    ask.folder = folder  # type: ignore[attr-defined]  # a place for the tests' files
    yield ask
    driver.stdin.close()
    driver.wait(timeout=30)
    driver.stdout.close()


def test_a_list_of_nodes_is_never_empty_beside_running_nodes(ros2):
    """Fast DDS may lose one node's answer until that node announces itself again; it never loses all of them here."""
    for _ in range(4):
        found = ros2("node", "list").out.split()
        assert found
        assert set(found) <= {"/robot_controller", "/sensor_processor"}
    until(lambda: ros2("node", "list").out == "/robot_controller\n/sensor_processor\n")


def test_topics_are_listed_and_described(ros2):
    """On a busy machine a list may lack what a node offers, as above; so lists are asked for again."""
    wanted = {"/cmd_vel [geometry_msgs/msg/Twist]", f"/sensor_fusion_data [{TYPE}/msg/SensorFusionData]"}
    until(lambda: wanted <= set(ros2("topic", "list", "-t").out.splitlines()))
    assert ros2("topic", "info", "/scan").out == (
        "Type: sensor_msgs/msg/LaserScan\nPublisher count: 0\nSubscription count: 1\n"
    )
    unknown = ros2("topic", "info", "/nope")
    assert (unknown.code, unknown.err) == (1, "Unknown topic '/nope'\n")


def test_echo_prints_yaml(ros2):
    zero = "x: 0.0\ny: 0.0\nz: 0.0\n"
    assert ros2("topic", "echo", "--once", "--field", "linear", "/cmd_vel").out == zero + "---\n"
    missing = ros2("topic", "echo", "/nope")
    assert missing.code == 1
    assert missing.err == (
        "WARNING: topic [/nope] does not appear to be published yet\n"
        "Could not determine the type for the passed topic\n"
    )


def test_pub_reaches_a_node(ros2):
    """With a filled-in header; a wrong field is refused."""
    scan = "{header: auto, angle_increment: 0.1, range_min: 0.1, range_max: 5.0, ranges: [0.3]}"
    done = ros2("topic", "pub", "--once", "/scan", "sensor_msgs/msg/LaserScan", scan)
    assert "publisher: beginning loop\npublishing #1: sensor_msgs.msg.LaserScan(header=" in done.out
    assert done.code == 0
    wrong = ros2("topic", "pub", "--once", "-w", "0", "/x", "std_msgs/msg/String", "{dat: 1}")
    assert (wrong.code, wrong.err) == (1, "Failed to populate field: 'String' object has no attribute 'dat'\n")


def test_hz_measures_the_rate_of_a_topic(ros2):
    said = ros2("topic", "hz", "/cmd_vel", interrupt_s=8).out
    rate = float(re.findall(r"average rate: ([0-9.]+)", said)[-1])
    assert 5 < rate < 15
    assert re.search(r"\tmin: [0-9.]+s max: [0-9.]+s std dev: [0-9.]+s window: \d+", said)


def test_services_are_listed_and_called(ros2):
    until(lambda: f"/set_speed [{TYPE}/srv/SetSpeed]\n" in ros2("service", "list", "-t").out)
    assert ros2("service", "type", "/set_speed").out == f"{TYPE}/srv/SetSpeed\n"
    until(lambda: ros2("service", "find", f"{TYPE}/srv/SetSpeed").out == "/set_speed\n")
    called = ros2("service", "call", "/set_speed", f"{TYPE}/srv/SetSpeed", "{speed: 9.0}").out
    assert f"requester: making request: {TYPE}.srv.SetSpeed_Request(speed=9.0)\n\nresponse:\n" in called
    assert f"{TYPE}.srv.SetSpeed_Response(success=False, message=" in called


def test_a_node_is_described(ros2):
    said = ros2("node", "info", "/robot_controller").out
    assert said.startswith("/robot_controller\n  Subscribers:\n    /odom: nav_msgs/msg/Odometry\n")
    assert (
        f"  Action Servers:\n    /navigate_to_position: {TYPE}/action/NavigateToPosition\n  Action Clients:\n" in said
    )
    assert (
        "  Service Clients:\n\n  Action Servers:\n\n  Action Clients:\n\n"
        in ros2("node", "info", "/sensor_processor").out
    )
    assert ros2("node", "info", "/nope").err == "Unable to find node '/nope'\n"


def test_a_goal_is_sent_and_followed_with_feedback(ros2):
    expected = f"/navigate_to_position [{TYPE}/action/NavigateToPosition]\n"
    until(lambda: ros2("action", "list", "-t").out == expected)
    assert "Action servers: 1\n    /robot_controller\n" in ros2("action", "info", "/navigate_to_position").out
    odometry = str(ros2.folder / "odom.log")
    # A pose is as old as its stamp says, so one without a stamp does not count.
    ros2("topic", "pub", "-r", "10", "/odom", "nav_msgs/msg/Odometry", "{header: auto}", background=odometry)
    goal = "{target_pose: {position: {x: 0.01}}, tolerance: 0.5}"
    sent = ros2("action", "send_goal", "-f", "/navigate_to_position", f"{TYPE}/action/NavigateToPosition", goal)
    assert "Goal accepted with ID: " in sent.out
    assert "Result:\n    success: true\n" in sent.out
    assert sent.out.endswith("Goal finished with status: SUCCEEDED\n")


def test_parameters_are_listed_set_dumped_and_loaded(ros2):
    node = "/sensor_processor"
    assert "  fusion_frequency\n" in ros2("param", "list", node).out
    assert ros2("param", "get", node, "fusion_frequency").out == "Double value is: 20.0\n"
    assert ros2("param", "set", node, "fusion_frequency", "10.0").out == "Set parameter successful\n"
    refused = ros2("param", "set", node, "fusion_frequency", "-1.0")
    assert refused.out.startswith("Setting parameter failed: ")
    assert refused.code == 0, "as with the real command"
    dumped = ros2("param", "dump", node).out
    assert dumped.startswith("/sensor_processor:\n  ros__parameters:\n    battery_critical_threshold: 10.0\n")
    assert "    fusion_frequency: 10.0\n" in dumped
    file = ros2.folder / "params.yaml"
    file.write_text("/**:\n  ros__parameters:\n    fusion_frequency: 20.0\n")
    assert ros2("param", "load", node, str(file)).out == "Set parameter fusion_frequency successful\n"
    assert ros2("param", "describe", node, "fusion_frequency").out.startswith(
        "Parameter name: fusion_frequency\n  Type: double\n"
    )
    undeclared = ros2("param", "describe", node, "fusion_rate")
    assert (undeclared.code, undeclared.out) == (0, ""), "as with the real command"
    assert undeclared.err.startswith("fusion_rate: Parameter not set\n")
    assert ros2("param", "get", "/nope", "x").err == "Node not found\n"


def test_a_bag_is_recorded_and_played(ros2):
    bag = str(ros2.folder / "bag")
    said = ros2.folder / "record.log"
    recorder = ros2("bag", "record", "-o", bag, "/cmd_vel", background=str(said))
    until(lambda: "Subscribed to topic '/cmd_vel'" in said.read_text())
    ros2("topic", "echo", "--once", "/cmd_vel")  # by then more messages have arrived
    os.kill(recorder.pid, signal.SIGINT)
    until(lambda: "Recording stopped" in said.read_text())
    info = ros2("bag", "info", bag).out
    assert "Storage id:        mcap\n" in info
    count = int(re.search(r"Topic: /cmd_vel \| Type: geometry_msgs/msg/Twist \| Count: (\d+)", info)[1])  # type: ignore[index]
    assert count > 1  # of ten a second, on however busy a machine
    log = ros2.folder / "played.log"
    ros2("topic", "echo", "/again", "geometry_msgs/msg/Twist", background=str(log))
    assert ros2("bag", "play", "-r", "5", "--remap", "/cmd_vel:=/again", "--", bag).code == 0
    until(lambda: log.read_text().count("---") >= count - 1)
