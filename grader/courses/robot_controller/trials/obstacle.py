"""Trials with an obstacle."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from grader.trials.catalog import trial

from .between import at_rest

if TYPE_CHECKING:
    from grader.trials.stage import Stage

_POLE_M = 0.012  # radius; at 0.44 m it is three beams wide, so a robot that skips beams may miss it


def _drive_at_wall(stage: Stage, speed: float) -> None:
    stage.choices["speed"] = speed
    stage.run(0.3)
    stage.call("set_speed", speed=speed)
    # The wall is two metres away; the rest of the time shows whether the robot stays where it stopped.
    stage.run(2.0 / abs(speed) + 2.5)


@trial(serves=["F4", "F11"], world="wall_ahead")
def wall_fast(stage: Stage) -> None:
    """Drive at a wall at full speed."""
    _drive_at_wall(stage, 0.5)


@trial(serves=["F4"], world="wall_ahead", follows="wall_fast", at_rest=at_rest)
def wall_slow(stage: Stage) -> None:
    """Drive at a wall at a lower speed."""
    _drive_at_wall(stage, stage.choose("speed", [0.25, 0.3125, 0.375]))


@trial(serves=["F4", "F7", "F11"], follows="obstacle_vanishes", at_rest=at_rest)
def wall_backward(stage: Stage) -> None:
    """Drive backwards at an obstacle."""
    stage.add_obstacle(1.5, bearing=3.14159, radius=0.3)
    stage.choices["speed"] = -0.375
    stage.run(0.3)
    stage.call("set_speed", speed=-0.375)
    stage.run(1.0)
    stage.call("get_status")
    stage.run(5.0)


@trial(serves=["F4"], follows="obstacle_behind", at_rest=at_rest)
def pole_aside(stage: Stage) -> None:
    """Drive past a pole at the edge of the sector that the robot has to watch, then one at its other edge."""
    side = stage.choose("side", [-1.0, 1.0])
    # Slow, so that the pole stays within 60 degrees for longer than the robot may take to see it.
    stage.choices["speed"] = 0.125
    stage.run(0.3)
    stage.call("set_speed", speed=0.125)
    stage.run(0.7)
    # Three beams hit the pole, many the wall far behind it: the closest reading is one of the three.
    stage.add_obstacle(2.5, radius=6.0)
    bearing = side * math.radians(stage.between("degrees", 52.0, 54.0))
    pole = stage.add_obstacle(0.44, bearing=bearing, radius=_POLE_M)
    stage.run(2.0)
    stage.mark("free")
    stage.remove_obstacle(pole)
    stage.run(1.0)
    stage.mark("other side")
    stage.add_obstacle(0.44, bearing=-bearing, radius=_POLE_M)
    stage.run(2.0)


@trial(serves=["F4"], follows="wall_slow", at_rest=at_rest)
def creeping(stage: Stage) -> None:
    """Creep up to an obstacle at one of the lowest valid speeds."""
    stage.run(0.3)
    stage.call("set_speed", speed=stage.choose("speed", [0.0625, 0.09375]))
    stage.run(0.7)
    stage.add_obstacle(0.56, radius=0.3)
    stage.run(4.0)


@trial(serves=["F4", "F5", "F11"], follows="pole_aside", at_rest=at_rest)
def obstacle_vanishes(stage: Stage) -> None:
    """Block the way suddenly and free it again, then once more after the robot has slowed down."""
    stage.run(0.3)
    stage.call("set_speed", speed=stage.choose("speed", [0.4375, 0.46875]))
    stage.run(1.0)
    name = stage.add_obstacle(0.45)
    stage.mark("blocked")
    stage.run(0.8)
    beside = stage.add_obstacle(0.185, bearing=1.9, radius=0.1)  # closer than emergency_stop_distance
    stage.run(0.7)
    stage.remove_obstacle(name)
    stage.remove_obstacle(beside)
    stage.mark("free")
    stage.run(1.0)
    stage.mark("cruise")
    stage.run(1.5)
    stage.mark("cruise_end")
    far = stage.add_obstacle(0.78)
    stage.run(0.6)
    near = stage.add_obstacle(0.4)
    stage.run(0.8)
    stage.remove_obstacle(far)
    stage.remove_obstacle(near)
    stage.run(1.0)
    stage.mark("again")
    stage.run(1.0)
    stage.mark("again_end")


@trial(serves=["F5", "F7"])
def obstacle_behind(stage: Stage) -> None:
    """Drive forward with an obstacle right behind the robot."""
    stage.add_obstacle(stage.between("distance", 0.35, 0.45), bearing=3.14159)
    stage.run(0.3)
    stage.call("set_speed", speed=0.25)
    stage.mark("start")
    stage.run(2.0)
    stage.mark("end")


@trial(serves=["F7"], notes_functions=True)
def status(stage: Stage) -> None:
    """Ask for the status standing, driving, at an obstacle, after it, beside a pole, and backwards."""
    stage.run(0.5)
    stage.call("get_status")
    stage.call("set_speed", speed=stage.choose("speed", [0.25, 0.375]))
    stage.run(1.5)
    stage.call("get_status")
    name = stage.add_obstacle(0.45)
    stage.run(1.0)
    stage.call("get_status")
    stage.remove_obstacle(name)
    stage.run(1.0)
    stage.call("get_status")
    # At least 64 degrees to one side, and soon directly beside the robot: only 60 degrees count as ahead.
    pole = stage.add_obstacle(0.4, bearing=math.radians(stage.choose("aside", [-70.0, 70.0])), radius=0.05)
    stage.run(0.2)
    stage.call("get_status")
    stage.remove_obstacle(pole)
    stage.call("set_speed", speed=-0.25)
    stage.run(0.6)
    stage.mark("backwards")
    ahead = stage.add_obstacle(0.35)
    stage.run(0.5)  # at 0.25 m/s it is still nearer than the threshold then
    stage.call("get_status")
    stage.remove_obstacle(ahead)
    stage.add_obstacle(0.45, bearing=math.pi)
    stage.run(0.8)  # F4 judges how soon it is seen
    stage.call("get_status")
