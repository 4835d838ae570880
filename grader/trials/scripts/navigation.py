"""Trials of the navigation action in an open field."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from grader.trials.catalog import trial

if TYPE_CHECKING:
    from grader.trials.stage import Stage


def _go(stage: Stage, bearing: float, distance: float, tolerance: float) -> None:
    """Send the robot to a place at `bearing` (radians, from where it looks) and watch it arrive and stand."""
    stage.run(0.5)
    pose = stage.simulator.odometry().pose
    angle = pose.yaw + bearing
    goal = stage.navigate(pose.x + distance * math.cos(angle), pose.y + distance * math.sin(angle), tolerance)
    stage.run_until(lambda: goal.ended, 40.0)
    stage.mark("ended")
    stage.run(1.5)


@trial(serves=["F8"])
def navigate_ahead(stage: Stage) -> None:
    """A target ahead, a little to one side."""
    side = stage.choose("side", [-1.0, 1.0])
    _go(stage, side * stage.between("bearing", 0.05, 0.4), stage.between("distance", 1.0, 2.0), 0.1)


@trial(serves=["F8"])
def navigate_beside(stage: Stage) -> None:
    """A target square to the robot's side."""
    side = stage.choose("side", [-1.0, 1.0])
    _go(stage, side * stage.between("bearing", 1.4, 1.8), stage.between("distance", 0.8, 1.6), 0.15)


@trial(serves=["F8"])
def navigate_behind(stage: Stage) -> None:
    """A target behind the robot's back."""
    side = stage.choose("side", [-1.0, 1.0])
    _go(stage, side * stage.between("bearing", 2.7, 3.1), stage.between("distance", 0.8, 1.6), 0.1)
