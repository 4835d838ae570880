"""Trials of the navigation action."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from grader.trials.catalog import trial

if TYPE_CHECKING:
    from grader.trials.stage import Stage


def _go(stage: Stage, bearing: float, distance: float, tolerance: float) -> None:
    """Send the robot to a place at `bearing` (radians, from where it looks) and watch it arrive and stand."""
    stage.run(0.5)
    goal = stage.navigate(*_place(stage, bearing, distance), tolerance)
    stage.run_until(lambda: goal.ended, 40.0)
    stage.mark("ended")
    stage.run(2.5)


def _place(stage: Stage, bearing: float, distance: float) -> tuple[float, float]:
    pose = stage.simulator.odometry().pose
    angle = pose.yaw + bearing
    return pose.x + distance * math.cos(angle), pose.y + distance * math.sin(angle)


@trial(serves=["F8", "F9", "F11"])
def navigate_ahead(stage: Stage) -> None:
    """A target ahead, a little to one side."""
    side = stage.choose("side", [-1.0, 1.0])
    _go(stage, side * stage.between("bearing", 0.05, 0.4), stage.between("distance", 1.5, 2.5), 0.1)


@trial(serves=["F8", "F9", "F11"])
def navigate_beside(stage: Stage) -> None:
    """A target square to the robot's side."""
    side = stage.choose("side", [-1.0, 1.0])
    _go(stage, side * stage.between("bearing", 1.4, 1.8), stage.between("distance", 0.8, 1.6), 0.3)


@trial(serves=["F8", "F9", "F11"])
def navigate_behind(stage: Stage) -> None:
    """A target behind the robot's back."""
    side = stage.choose("side", [-1.0, 1.0])
    _go(stage, side * stage.between("bearing", 2.7, 3.1), stage.between("distance", 0.8, 1.6), 0.1)


@trial(serves=["F3", "F7", "F8"])
def navigate_again(stage: Stage) -> None:
    """A target where the robot already is; another, on the way to which the services are called; a third after that."""
    stage.run(0.5)
    here = stage.navigate(*_place(stage, 0.0, 0.03), 0.25)
    if here.problem:
        return  # there is no action yet: half a minute of waiting would show nothing
    stage.run_until(lambda: here.ended, 10.0)
    stage.run(0.5)
    side = stage.choose("side", [-1.0, 1.0])
    goal = stage.navigate(*_place(stage, side * stage.between("bearing", 0.3, 0.8), 1.2), 0.15)
    stage.run(1.0)
    stage.call("get_status")
    stage.call("set_speed", speed=0.75)
    goal.cancel()
    stage.run(1.5)
    third = stage.navigate(*_place(stage, side * 0.3, 0.8), 0.15)
    stage.run_until(lambda: third.ended, 30.0)


@trial(serves=["F10"])
def cancel_early(stage: Stage) -> None:
    """Cancel a goal while the robot still turns."""
    stage.run(0.5)
    goal = stage.navigate(*_place(stage, 2.0, 2.0))
    stage.run(0.4)
    goal.cancel()
    stage.run(2.0)


@trial(serves=["F10"])
def cancel_late(stage: Stage) -> None:
    """Cancel a goal while the robot drives."""
    stage.run(0.5)
    goal = stage.navigate(*_place(stage, 0.1, 4.0))
    stage.run(3.0)
    goal.cancel()
    stage.run(2.0)


@trial(serves=["F10"])
def cancel_blocked(stage: Stage) -> None:
    """Set a speed, send a goal, cancel it while something is in the way, and clear the way."""
    stage.run(0.3)
    stage.call("set_speed", speed=0.125)
    stage.run(0.5)
    goal = stage.navigate(*_place(stage, 0.1, 3.0))
    stage.run(1.5)
    name = stage.add_obstacle(0.4)
    stage.run(1.0)
    goal.cancel()
    stage.run(1.0)
    stage.remove_obstacle(name)
    stage.mark("free")
    stage.run(1.5)


@trial(serves=["F9", "F11"])
def blocked_goal(stage: Stage) -> None:
    """Something gets into the way to a goal and goes away after a while."""
    stage.run(0.5)
    goal = stage.navigate(*_place(stage, stage.between("bearing", -0.2, 0.2), 2.5), 0.15)
    stage.run(2.0)
    name = stage.add_obstacle(stage.between("distance", 0.7, 1.0), radius=0.4)
    stage.mark("blocked")
    stage.run(12.0)
    stage.remove_obstacle(name)
    stage.mark("free")
    stage.run_until(lambda: goal.ended, 40.0)
    stage.mark("ended")
    stage.run(0.5)
