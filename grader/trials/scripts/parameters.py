"""Trials of parameters: from files, as overrides, at run time; valid and invalid."""

from __future__ import annotations

from typing import TYPE_CHECKING

from grader.contract.spec import PARAMETERS
from grader.trials.catalog import trial

if TYPE_CHECKING:
    from grader.trials.stage import Stage


@trial(serves=["I6"], params_file="robot_params.yaml")
def file_controller(stage: Stage) -> None:
    """Start the controller with its parameter file, in which some values were changed."""
    for name in ("robot_name", *PARAMETERS["robot_controller"]):
        stage.get_parameter(name)


@trial(serves=["I6"], node="sensor_processor", params_file="sensor_params.yaml")
def file_processor(stage: Stage) -> None:
    """Start the sensor processor with its parameter file, in which some values were changed."""
    for name in PARAMETERS["sensor_processor"]:
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
    for name in PARAMETERS["robot_controller"]:
        stage.set_parameter(name, -1.0)
    for name in ("laser_processing_rate", "fusion_rate"):
        stage.set_parameter(name, 0.0)
    stage.set_parameter("max_linear_speed", 0.375)
    stage.run(1.0)


@trial(serves=["I6"], node="sensor_processor")
def senseless_settings_processor(stage: Stage) -> None:
    """Set parameters of the running sensor processor to invalid values, then one to a valid value."""
    stage.run(0.3)
    for name in PARAMETERS["sensor_processor"]:
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
