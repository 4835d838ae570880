"""Trials of the navigation action."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from grader.trials.catalog import trial

from .between import at_rest

if TYPE_CHECKING:
    from grader.trials.stage import Stage


def _go(stage: Stage, bearing: float, distance: float, tolerance: float) -> None:
    """Send the robot to a target at `bearing` (rad, from its heading) and watch it arrive and stop."""
    stage.run(0.5)
    goal = stage.navigate(*_target(stage, bearing, distance), tolerance)
    stage.run_until(lambda: goal.ended, 40.0)
    stage.mark("ended")
    stage.run(2.5)


def _target(stage: Stage, bearing: float, distance: float) -> tuple[float, float]:
    """Return a position in the odom frame, `distance` metres away at `bearing`."""
    pose = stage.simulator.odometry().pose
    angle = pose.yaw + bearing
    return pose.x + distance * math.cos(angle), pose.y + distance * math.sin(angle)


@trial(serves=["F3", "F7", "F8"], takes_long=True)  # a goal without feedback runs in real time
def navigate_again(stage: Stage) -> None:
    """Send three goals: to its own place, one cancelled after calls, one after a speed; ask for status."""
    stage.run(0.5)
    here = stage.navigate(*_target(stage, 0.0, 0.03), 0.25)
    if here.problem:
        return  # there is no action yet: waiting half a minute would show nothing
    stage.run_until(lambda: here.ended, 10.0)
    stage.run(0.5)
    side = stage.choose("side", [-1.0, 1.0])
    goal = stage.navigate(*_target(stage, side * stage.between("bearing", 0.3, 0.8), 1.2), 0.15)
    stage.run(1.0)
    stage.call("get_status")
    stage.call("set_speed", speed=0.75)
    goal.cancel()
    stage.run(1.5)
    stage.call("set_speed", speed=0.125)
    third = stage.navigate(*_target(stage, side * 0.3, 0.8), 0.15)
    stage.run_until(lambda: third.ended, 30.0)
    stage.run(0.5)
    stage.call("get_status")
    stage.run(1.5)


@trial(serves=["F8", "F9", "F11"])
def navigate_ahead(stage: Stage) -> None:
    """Navigate to a target ahead, a little to one side."""
    side = stage.choose("side", [-1.0, 1.0])
    _go(stage, side * stage.between("bearing", 0.05, 0.4), stage.between("distance", 1.5, 2.5), 0.1)


@trial(serves=["F8", "F9", "F11"], notes_functions=True)
def navigate_beside(stage: Stage) -> None:
    """Navigate to a target directly beside the robot."""
    side = stage.choose("side", [-1.0, 1.0])
    _go(stage, side * stage.between("bearing", 1.4, 1.8), stage.between("distance", 0.8, 1.6), 0.3)


@trial(serves=["F8", "F9", "F11"])
def navigate_behind(stage: Stage) -> None:
    """Navigate to a target behind the robot."""
    side = stage.choose("side", [-1.0, 1.0])
    _go(stage, side * stage.between("bearing", 2.7, 3.1), stage.between("distance", 0.8, 1.6), 0.1)


@trial(serves=["F8"])
def navigate_short(stage: Stage) -> None:
    """Navigate, with a large tolerance, to a target in front of an obstacle: the robot ends beside it.

    Elsewhere a robot ends so near to its target that a final_pose copied from the target agrees with odometry.
    """
    stage.run(0.5)
    distance = stage.between("distance", 1.5, 2.0)
    goal = stage.navigate(*_target(stage, 0.0, distance), 0.6)
    stage.add_obstacle(distance + 0.3, radius=0.4)
    stage.run_until(lambda: goal.ended, 10.0)
    stage.run(0.5)


@trial(serves=["F10"], follows="obstacle_among_bad_readings", at_rest=at_rest)
def cancel_early(stage: Stage) -> None:
    """Cancel a goal while the robot is still turning."""
    stage.run(0.5)
    goal = stage.navigate(*_target(stage, 2.0, 2.0))
    stage.run(0.4)
    goal.cancel()
    stage.run(2.0)


@trial(serves=["F10"], follows="creeping", at_rest=at_rest)
def cancel_late(stage: Stage) -> None:
    """Cancel a goal while the robot is driving."""
    stage.run(0.5)
    goal = stage.navigate(*_target(stage, 0.1, 4.0))
    stage.run(3.0)
    goal.cancel()
    stage.run(2.0)


@trial(serves=["F10"], follows="wall_backward", at_rest=at_rest)
def cancel_blocked(stage: Stage) -> None:
    """Set a speed, send a goal, cancel it in front of an obstacle, and remove the obstacle."""
    stage.run(0.3)
    stage.call("set_speed", speed=0.125)
    stage.run(0.5)
    goal = stage.navigate(*_target(stage, 0.1, 3.0))
    stage.run(1.5)
    name = stage.add_obstacle(0.4)
    stage.run(1.0)
    goal.cancel()
    stage.run(1.0)
    stage.remove_obstacle(name)
    stage.mark("free")
    stage.run(1.5)


@trial(serves=["F9", "F11"], takes_long=True)
def blocked_goal(stage: Stage) -> None:
    """Block the way to a goal for a while."""
    stage.run(0.5)
    goal = stage.navigate(*_target(stage, stage.between("bearing", -0.2, 0.2), 2.5), 0.15)
    stage.run(2.0)
    name = stage.add_obstacle(stage.between("distance", 0.7, 1.0), radius=0.4)
    stage.mark("blocked")
    stage.run(12.0)
    stage.remove_obstacle(name)
    stage.mark("free")
    stage.run_until(lambda: goal.ended, 40.0)
    stage.mark("ended")
    stage.run(0.5)


@trial(serves=["F4"], follows="status", at_rest=at_rest)
def emergency(stage: Stage) -> None:
    """Let something appear within the emergency distance: beside it as it creeps, behind it as it turns."""
    side = stage.choose("side", [-1.0, 1.0])
    stage.run(0.3)
    # So slow that it leaves what is beside it no sooner than it has to stop.
    stage.call("set_speed", speed=0.0625)
    stage.run(0.7)
    _show_too_near(stage, "beside", side * stage.between("beside", 1.6, 1.9))
    stage.call("set_speed", speed=0.0)
    stage.run(0.3)
    goal = stage.navigate(*_target(stage, side * stage.between("goal", 2.6, 2.9), 1.5))
    if goal.problem or not goal.accepted:
        return
    stage.run(0.7)
    # On the side from which it turns away, and out of the sector ahead for as long as it may turn on.
    _show_too_near(stage, "behind", -side * stage.between("behind", 2.2, 2.6))


def _show_too_near(stage: Stage, where: str, bearing: float) -> None:
    stage.mark(where)
    obstacle = stage.add_obstacle(0.182, bearing=bearing, radius=0.1)
    stage.run(1.0)
    stage.mark(f"{where}, gone")
    stage.remove_obstacle(obstacle)
    stage.run(0.3)
