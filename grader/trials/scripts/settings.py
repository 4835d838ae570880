"""Trials of parameters (from files, as overrides, at run time; valid and invalid), of the clock and of Ctrl-C."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from grader.trials.catalog import trial

if TYPE_CHECKING:
    from grader.trials.stage import Stage

CONTROLLER = (
    "robot_name", "max_linear_speed", "max_angular_speed", "linear_acceleration", "angular_acceleration",
    "laser_processing_rate", "fusion_rate", "obstacle_detection_threshold", "emergency_stop_distance", "safety_margin",
)  # fmt: skip
PROCESSOR = ("fusion_frequency", "battery_low_threshold", "battery_critical_threshold")


@trial(serves=["I6"], params_file="robot_params.yaml")
def file_controller(stage: Stage) -> None:
    """Start the controller with its parameter file, in which some values were changed."""
    for name in CONTROLLER:
        stage.get_parameter(name)


@trial(serves=["I6"], node="sensor_processor", params_file="sensor_params.yaml")
def file_processor(stage: Stage) -> None:
    """Start the sensor processor with its parameter file, in which some values were changed."""
    for name in PROCESSOR:
        stage.get_parameter(name)


@trial(serves=["F3", "I6"], parameters={"max_linear_speed": 0.25})
def slow_robot(stage: Stage) -> None:
    """Start the controller with half the default speed limit."""
    stage.run(0.3)
    stage.call("set_speed", speed=0.375)
    stage.run(0.3)
    stage.call("set_speed", speed=0.1875)
    stage.run(0.3)


@trial(serves=["I6"], world="wall_ahead", parameters={"obstacle_detection_threshold": 1.0})
def far_sighted_robot(stage: Stage) -> None:
    """Start the controller with twice the default obstacle threshold."""
    stage.run(0.3)
    stage.call("set_speed", speed=0.25)
    stage.run(7.0)


@trial(serves=["I6"])
def senseless_settings(stage: Stage) -> None:
    """Set parameters of the running controller to invalid values, then one to a valid value."""
    stage.run(0.3)
    for name in CONTROLLER:
        if name != "robot_name":
            stage.set_parameter(name, -1.0)
    for name in ("laser_processing_rate", "fusion_rate"):
        stage.set_parameter(name, 0.0)
    stage.set_parameter("max_linear_speed", 0.375)
    stage.run(1.0)


@trial(serves=["I6"], node="sensor_processor")
def senseless_settings_processor(stage: Stage) -> None:
    """Set parameters of the running sensor processor to invalid values, then one to a valid value."""
    stage.run(0.3)
    for name in PROCESSOR:
        stage.set_parameter(name, -5.0)
    stage.set_parameter("fusion_frequency", 0.0)
    stage.set_parameter("fusion_frequency", 10.0)
    stage.run(0.5)


@trial(serves=["I6"], parameters={"max_linear_speed": -1.0})
def senseless_start(stage: Stage) -> None:
    """Start the controller with a negative speed limit."""
    stage.get_parameter("max_linear_speed")


@trial(serves=["I6"], node="sensor_processor", parameters={"fusion_frequency": 0.0})
def senseless_start_processor(stage: Stage) -> None:
    """Start the sensor processor with a rate of zero."""
    stage.get_parameter("fusion_frequency")


@trial(serves=["I7"])
def standing_clock(stage: Stage) -> None:
    """Stop the clock for a while as the robot drives."""
    stage.call("set_speed", speed=0.25)
    stage.run(2.0)
    stage.choices["held"] = stage.freeze_clock(1.0)
    stage.run(1.0)


@trial(serves=["I7"], node="sensor_processor")
def standing_clock_processor(stage: Stage) -> None:
    """Stop the clock for a while as the sensor processor runs."""
    stage.run(2.0)
    stage.choices["held"] = stage.freeze_clock(1.0)
    stage.run(1.0)


@trial(serves=["I8"])
def interrupted_idle(stage: Stage) -> None:
    """Press Ctrl-C while the robot stands still."""
    stage.run(0.5)
    stage.interrupt()


@trial(serves=["I8"])
def interrupted_driving(stage: Stage) -> None:
    """Press Ctrl-C while the robot is driving."""
    stage.run(0.3)
    stage.call("set_speed", speed=0.375)
    stage.run(1.5)
    stage.interrupt()


@trial(serves=["I8"])
def interrupted_navigating(stage: Stage) -> None:
    """Press Ctrl-C while the robot is driving to a goal."""
    stage.run(0.3)
    pose = stage.simulator.odometry().pose
    stage.navigate(pose.x + 3.0 * math.cos(pose.yaw), pose.y + 3.0 * math.sin(pose.yaw))
    stage.run(1.5)
    stage.interrupt()


@trial(serves=["I8"], node="sensor_processor")
def interrupted_processor(stage: Stage) -> None:
    """Press Ctrl-C while the sensor processor is publishing."""
    stage.run(0.5)
    stage.interrupt()
