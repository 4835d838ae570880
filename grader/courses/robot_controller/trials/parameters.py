"""Trials of parameters: from files, as overrides, at run time; valid and invalid."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from grader.trials import stock
from grader.trials.catalog import trial
from sim.sensors import ImuReading

from .between import at_rest

if TYPE_CHECKING:
    from grader.trials.stage import Stage

OTHER_SETTINGS = {
    "laser_processing_rate": 20.0,
    "linear_acceleration": 0.5,
    "angular_acceleration": 0.5,
    "max_angular_speed": 0.5,
    "emergency_stop_distance": 0.4,
    "safety_margin": 1.0,
}
"""Values other than the defaults, each of which shows in what the robot does."""
_SLOW_AND_FAR_SIGHTED = {"max_linear_speed": 0.25, "obstacle_detection_threshold": 1.0}


@trial(serves=["F3", "I6"], parameters=_SLOW_AND_FAR_SIGHTED)
def slow_robot(stage: Stage) -> None:
    """Start the controller with half the default speed limit."""
    stage.run(0.3)
    stage.call("set_speed", speed=0.375)
    stage.run(0.3)
    stage.call("set_speed", speed=0.1875)
    stage.run(0.3)


@trial(serves=["I6"], parameters=_SLOW_AND_FAR_SIGHTED, follows="slow_robot", at_rest=at_rest)
def far_sighted_robot(stage: Stage) -> None:
    """Start the controller with twice the default obstacle threshold; show an obstacle between the two."""
    stage.run(0.3)
    stage.call("set_speed", speed=0.25)
    stage.run(1.0)
    # Appears at once: a robot that slows down by the parameter would never come to a wall that it approaches.
    stage.add_obstacle(stage.between("distance", 0.8, 0.9))
    stage.mark("obstacle")
    stage.run(1.0)  # at 0.25 m/s it is still farther than the default threshold then
    stage.mark("end")


@trial(follows="refuse_speed", at_rest=at_rest)
def senseless_settings_robot_controller(stage: Stage) -> None:
    """Do as the stock trial does."""
    stock.senseless_settings(stage)


@trial(node="sensor_processor", follows="fine_clock")
def senseless_settings_sensor_processor(stage: Stage) -> None:
    """Do as the stock trial does, and see at which rate the node goes on."""
    stage.mute(ImuReading)
    stage.listen("sensor_fusion_data")
    stock.senseless_settings(stage)
    stage.mark("changed")
    stage.run(1.5)


@trial(serves=["Q4"], parameters=OTHER_SETTINGS)
def other_settings(stage: Stage) -> None:
    """Start the controller with other settings; drive at an obstacle, past another one, and to a goal."""
    stage.choices |= OTHER_SETTINGS
    stage.run(0.5)
    stage.mark("idle")
    stage.run(1.0)
    stage.mark("start")
    stage.call("set_speed", speed=0.4375)
    stage.run(1.2)
    # Beyond the default margin, and still so when it is removed. F4 judges how soon it is seen.
    ahead = stage.add_obstacle(1.25)
    stage.mark("ahead")
    stage.run(0.8)
    stage.remove_obstacle(ahead)
    stage.mark("slowed")
    stage.call("set_speed", speed=0.125)
    stage.run(0.8)
    side = stage.choose("side", [-1.0, 1.0])
    # More than 60 degrees to one side, and nearer than the emergency distance, though farther than its default.
    beside = stage.add_obstacle(0.3, bearing=side * 1.9, radius=0.1)
    stage.mark("beside")
    stage.run(0.7)
    stage.remove_obstacle(beside)
    stage.mark("gone")
    stage.run(0.3)
    pose = stage.simulator.odometry().pose
    angle = pose.yaw + side * 1.6
    stage.navigate(pose.x + math.cos(angle), pose.y + math.sin(angle), 0.2)
    stage.mark("goal")
    stage.run(2.0)
    stage.mark("end")


@trial(serves=["F3", "F11"], takes_long=True)
def changed_limits(stage: Stage) -> None:
    """Lower the running controller's limits at full speed, then on the way to a goal; drive backwards."""
    stage.run(0.3)
    stage.call("set_speed", speed=0.5)
    stage.run(1.0)
    stage.set_parameter("max_linear_speed", 0.25)
    stage.run(1.0)
    stage.call("set_speed", speed=0.375)
    stage.run(0.3)
    stage.set_parameter("max_angular_speed", 0.5)
    stage.call("set_speed", speed=0.0)
    stage.run(0.5)
    stage.call("set_speed", speed=-0.1875)
    stage.run(0.8)
    pose = stage.simulator.odometry().pose
    angle = pose.yaw + stage.choose("side", [-1.0, 1.0]) * 1.6
    stage.navigate(pose.x + 1.5 * math.cos(angle), pose.y + 1.5 * math.sin(angle), 0.2)
    stage.run(5.0)
    stage.set_parameter("max_linear_speed", 0.125)
    stage.run(1.0)
