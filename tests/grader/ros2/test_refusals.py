"""Remarks beside a refusal or during a wait: the name that was meant, a type that differs."""

from __future__ import annotations

from itertools import count

import pytest
import yaml

from grader import KIT
from grader.ros2.commands import graph, param, refusals

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
    assert refusals.near(name, ["/odom", "/scan", "/navigate_to_position"]) == said


def test_a_type_that_differs_is_a_warning():
    assert graph.other_type("odom", "geometry_msgs/msg/Twist", [ODOMETRY, ODOMETRY]) == (
        "WARNING: /odom is of type nav_msgs/msg/Odometry, not geometry_msgs/msg/Twist"
    )
    assert graph.other_type("/odom", "nav_msgs/Odometry", [ODOMETRY]) == "", "the middle word may be left out"
    assert graph.other_type("/odom", ODOMETRY, []) == ""


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
