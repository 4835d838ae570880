"""The reference package on the simulator's TurtleBot 4, by docs/turtlebot4: names, types and lidar as on a real one."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from helpers import beside
from helpers.course import COURSE
from helpers.node_runs import run_with_node

from grader import KIT, building

TEXTS = beside(__file__)

FILES = KIT / "docs" / "turtlebot4"

pytestmark = [pytest.mark.ros, pytest.mark.sandbox, pytest.mark.slow]  # a build, and three launches


# The adapter is asked like the controller whether it is done with a tick.
def drive(tmp_path: Path, reference: Path, world: str, robot: str, *arguments: str) -> dict[str, Any]:
    """Launch the reference beside a robot in a namespace of a world, set a speed, and return what happened."""
    install = building.build([reference], building.cache_folder(), COURSE).install
    (tmp_path / "host.py").write_text(TEXTS["HOST"])
    command = [str(KIT / "grader" / "ros2"), "launch", str(FILES / "turtlebot4_launch.py"), "use_sim_time:=true"]
    found = run_with_node(tmp_path / "host.py", str(install), str(tmp_path), world, robot, *command, *arguments)
    assert found["ready"], found["log"]
    return found


def test_the_reference_stops_before_a_wall_on_a_turtlebot_4(tmp_path: Path, reference: Path):
    """Its lidar is turned by 90 degrees, its topics are in a namespace, and it takes only TwistStamped."""
    found = drive(tmp_path, reference, "wall_ahead", "/robot1", "namespace:=/robot1")
    assert found["answers"] == [False, True], found["log"]  # 0.5 m/s is more than the base drives
    assert found["x"] > 1.0, found["log"]
    assert 0.28 < found["fastest"] <= 0.306
    assert found["contacts"] == 0
    assert found["clearance"] > 0.15
    assert (found["v"], found["last"]) == (0.0, [0.0])
    assert found["types"]["/robot1/cmd_vel"] == ["geometry_msgs/msg/TwistStamped"]
    assert found["types"]["/robot1/course/cmd_vel"] == ["geometry_msgs/msg/Twist"]
    assert found["actions"] == ["/robot1/course/navigate_to_position/_action/send_goal"]  # not the base's name
    assert found["battery"][0] > 90.0


@pytest.mark.parametrize(("turn", "contact"), [("1.5708", False), ("0.0", True)], ids=["turned", "as it is"])
def test_a_post_ahead_is_seen_only_where_the_lidars_turn_is_known(
    turn: str, contact: bool, tmp_path: Path, reference: Path
):
    """A lidar that is turned to the left takes what is ahead for something at the side."""
    post = tmp_path / "post.yaml"
    post.write_text("circles:\n  - {name: post, center: [1.5, 0.0], radius: 0.05}\n")
    found = drive(tmp_path, reference, str(post), "", f"laser_yaw:={turn}", "emergency_stop_distance:=0.0")
    assert bool(found["contacts"]) is contact, found
