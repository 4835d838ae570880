"""A package small enough to test in a second: plain Python, "installed" by copying; nothing is built."""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from grader.host import ros_env

CONTROLLER = '''\
"""Decide how fast to drive."""

TOP_SPEED = 0.5


class RobotController:
    """Drive, but not into anything."""

    def __init__(self):
        self.speed = 0.0
        self.published = []

    def set_speed(self, speed):
        """Take over a speed, if it is allowed."""
        if abs(speed) > TOP_SPEED:
            return False
        self.speed = speed
        return True

    def on_scan(self, distance):
        """Publish the speed, or zero before an obstacle."""
        if distance < 0.5:
            self.publish(0.0)
        else:
            self.publish(self.speed)

    def publish(self, speed):
        """Send a command."""
        self.published.append(speed)


def stop_distance(speed):
    """Return how far the robot goes until it has stopped, in metres."""
    braking = 2.0
    distance = speed * speed / (2 * braking)
    return max(distance, 0.0)
'''
PROCESSOR = '''\
"""Convert sensor values for display."""


def percent(share):
    """Return a share of one in percent, 0 to 100."""
    value = share * 100.0
    if value > 100.0:
        return 100.0
    return max(value, 0.0)


def never_called(first, second):
    """Return the larger sum."""
    if first > second:
        return first + 1
    return second - 1
'''
PROGRAM = """\
#!/usr/bin/env python3
from ros2_robot_controller.robot_controller import RobotController, stop_distance
from ros2_robot_controller.sensor_processor import never_called, percent

robot = RobotController()
robot.set_speed(never_called(0.1, percent(0.0)))
robot.on_scan(stop_distance(0.1))
"""
THOROUGH = """\
import pytest

from ros2_robot_controller.robot_controller import RobotController, stop_distance
from ros2_robot_controller.sensor_processor import percent


def test_a_speed_within_the_limit_is_taken_over():
    robot = RobotController()
    assert robot.set_speed(0.5)
    assert robot.speed == 0.5
    assert robot.set_speed(-0.25)
    assert robot.speed == -0.25


@pytest.mark.parametrize("speed", [0.6, -0.6, 0.9])
def test_a_speed_beyond_the_limit_changes_nothing(speed):
    robot = RobotController()
    assert robot.set_speed(0.3)
    assert not robot.set_speed(speed)
    assert robot.speed == 0.3


def test_it_publishes_its_speed_and_zero_before_an_obstacle():
    robot = RobotController()
    robot.on_scan(1.0)
    robot.set_speed(0.5)
    for distance in (1.0, 0.5, 0.49):
        robot.on_scan(distance)
    assert robot.published == [0.0, 0.5, 0.5, 0.0]


def test_braking_takes_distance():
    assert stop_distance(0.0) == 0.0
    assert stop_distance(0.5) == 0.0625
    assert stop_distance(-0.5) == 0.0625


@pytest.mark.parametrize(("share", "expected"), [(-0.1, 0.0), (0.0, 0.0), (0.25, 25.0), (1.0, 100.0), (1.1, 100.0)])
def test_shares_are_given_in_percent(share, expected):
    assert percent(share) == pytest.approx(expected)
"""


@dataclass(frozen=True)
class Toy:
    """A package folder and its install tree."""

    package: Path
    install: Path


def make(folder: Path, files: Mapping[str, str], modules: Mapping[str, str] | None = None) -> Toy:
    """Return a package with these test files and a program; `modules` replaces or adds modules of the package."""
    package = folder / "ros2_robot_controller"
    inside = {"__init__.py": "", "robot_controller.py": CONTROLLER, "sensor_processor.py": PROCESSOR} | dict(
        modules or {}
    )
    texts = (
        {f"ros2_robot_controller/{name}": text for name, text in inside.items()}
        | {"scripts/robot_controller": PROGRAM}
        | dict(files)
    )
    for name, text in texts.items():
        path = package / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    install = folder / "install"
    shutil.copytree(package / "ros2_robot_controller", install / ros_env.SITE_IN_PREFIX / "ros2_robot_controller")
    return Toy(package, install)
