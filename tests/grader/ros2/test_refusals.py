"""Remarks beside a refusal or during a wait: the name that was meant, a type that differs."""

from __future__ import annotations

import argparse
from contextlib import nullcontext
from itertools import count
from types import SimpleNamespace
from typing import Any
from unittest.mock import Mock

import pytest
import yaml

from grader import KIT
from grader.ros2 import commands
from grader.ros2.commands import bag, graph, param, topic

ODOMETRY = "nav_msgs/msg/Odometry"


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("/odomm", "\nDid you mean /odom?"),
        ("/navigate", "\nDid you mean /navigate_to_position?"),  # the beginning of just one
        ("/odom", ""),  # it exists
        ("/elsewhere", ""),
    ],
)
def test_the_nearest_name_is_suggested(name, said):
    assert commands.near(name, ["/odom", "/scan", "/navigate_to_position"]) == said


def test_a_type_that_differs_is_a_warning():
    assert graph.other_type("odom", "geometry_msgs/msg/Twist", [ODOMETRY, ODOMETRY]) == (
        "WARNING: /odom is of type nav_msgs/msg/Odometry, not geometry_msgs/msg/Twist"
    )
    assert graph.other_type("/odom", "nav_msgs/Odometry", [ODOMETRY]) == "", "the middle word may be left out"
    assert graph.other_type("/odom", ODOMETRY, []) == ""


def test_the_parameters_of_a_hidden_node_are_asked_for_by_a_flag():
    """As on a TurtleBot 4: `ros2 param set --include-hidden-nodes /_do_not_use/motion_control safety_override full`."""

    def nodes(hidden=False):
        return ["/robot_controller", *(["/_do_not_use/motion_control"] if hidden else [])]

    seen: Any = SimpleNamespace(node=None, nodes=nodes, has_node=lambda name, hidden: name in nodes(hidden))
    with pytest.raises(commands.Refusal, match="Node not found\nIt is hidden: add --include-hidden-nodes"):
        param.Parameters(seen, "/_do_not_use/motion_control")
    with pytest.raises(commands.Refusal, match="Node not found\nDid you mean /robot_controller"):
        param.Parameters(seen, "/robot_control", include_hidden=True)


@pytest.mark.ros
@pytest.mark.parametrize("verb", ["hz", "delay"])
def test_a_meter_asks_for_best_effort_whatever_is_offered(verb, monkeypatch):
    """So does Jazzy's command. Ours adapted to the publishers, and notebook 11 told that of every `hz`."""
    from rclpy.qos import qos_profile_sensor_data

    node = Mock()
    monkeypatch.setattr(topic, "graph", lambda *_, **__: nullcontext(SimpleNamespace(node=node)))
    monkeypatch.setattr(topic, "subscription", lambda *_, **__: ("/map", object, []))
    monkeypatch.setattr(topic, "spin", lambda *_: True)
    parser = argparse.ArgumentParser()
    topic.add_arguments(parser)
    args = parser.parse_args([verb, "/map"])
    args.run(args)
    assert node.create_subscription.call_args.args[-1] == qos_profile_sensor_data


def test_a_wait_prints_one_remark(monkeypatch, capsys):
    """Only after existing names have been found; the clock here advances by a second at each look."""
    clock = count()
    monkeypatch.setattr(graph.time, "monotonic", lambda: next(clock))
    monkeypatch.setattr(graph.time, "sleep", lambda _s: None)
    answers = iter([False] * 8 + [True])
    graph.wait(lambda: next(answers), "set_sped", "a/srv/B", lambda: [("/set_speed", ["a/srv/B"])])
    assert capsys.readouterr().err == "Did you mean /set_speed?\n"


def test_silence_is_explained_where_the_notebooks_have_a_domain_of_their_own(monkeypatch, tmp_path):
    """Beside a workspace, in a terminal that is not prepared; else an empty graph is an answer."""
    setup = tmp_path / "grader" / "ros2" / "setup.bash"
    monkeypatch.delenv("ROS_DOMAIN_ID", raising=False)
    assert graph.of_silence(setup) == ""
    (tmp_path / "ws" / "src").mkdir(parents=True)
    assert graph.of_silence(setup) == (
        f"No node is heard. Those of the notebooks are in a domain of their own; to join it: source {setup}"
    )
    monkeypatch.setenv("ROS_DOMAIN_ID", "7")
    assert graph.of_silence(setup) == ""


def test_a_parameter_file_is_loaded_whatever_node_its_keys_name():
    """The kit's own file was refused: its key is /**/robot_controller. Jazzy reads every key of a file."""
    own = yaml.safe_load((KIT / "solution_pkg/ros2_robot_controller/config/robot_params.yaml").read_text())
    assert param.values_of(own)["max_linear_speed"] == 0.5
    both = {"n": {"ros__parameters": {"a": {"b": 1}}}, "/**": {"ros__parameters": {"a": {"b": 2}, "c": 3}}}
    assert param.values_of(both) == {"a.b": 1, "c": 3}
    with pytest.raises(param.Refusal, match="not a valid ROS parameter file for node n"):
        param.values_of({"n": {"max_linear_speed": 1.0}})


@pytest.mark.ros
def test_one_best_effort_publisher_among_reliable_ones_is_heard_too():
    def offered(*reliabilities: str) -> list[SimpleNamespace]:
        volatile = SimpleNamespace(name="VOLATILE")
        return [SimpleNamespace(reliability=SimpleNamespace(name=name), durability=volatile) for name in reliabilities]

    assert graph.matching(offered("RELIABLE", "BEST_EFFORT")).reliability.name == "BEST_EFFORT"
    assert graph.matching(offered("RELIABLE", "RELIABLE")).reliability.name == "RELIABLE"
    assert graph.matching([]).reliability.name == "RELIABLE"


def test_a_bag_at_twice_its_rate_takes_half_its_time(monkeypatch):
    now = [10.0]
    monkeypatch.setattr(
        bag, "time", SimpleNamespace(monotonic=lambda: now[0], sleep=lambda s: now.__setitem__(0, now[0] + s))
    )
    connection, sent = SimpleNamespace(id=1), []
    recorded = SimpleNamespace(
        start_time=0,
        message_count=2,
        messages=lambda **_chosen: [(connection, 0, b"first"), (connection, 4 * 10**9, b"last")],
    )
    publishers = {1: SimpleNamespace(publish=lambda raw: sent.append((now[0] - 10.0, raw)))}
    bag._play(recorded, [connection], publishers, 2.0)
    assert sent == [(0.0, b"first"), (2.0, b"last")]
