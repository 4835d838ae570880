"""Trials of the sensor processor."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from grader.trials.catalog import trial
from sim.sensors import BatteryReading, ImuReading, ScanReading

from .readings import BAD, LIMITS

if TYPE_CHECKING:
    from grader.trials.stage import Stage

_OTHER_SETTINGS = {"battery_low_threshold": 30.0, "battery_critical_threshold": 15.0, "fusion_frequency": 10.0}


@trial(serves=["F12", "F13", "I6", "I7"], node="sensor_processor", notes_functions=True)
def fusion(stage: Stage) -> None:
    """Start the sensors one by one, put an obstacle near, and spoil some beams."""
    stage.set_range_limits(*LIMITS)
    stage.listen("sensor_fusion_data")
    stage.listen("obstacle_distance")
    stage.mute(ScanReading, ImuReading, BatteryReading)
    stage.run(0.8)
    stage.unmute(ScanReading)
    stage.mark("scans")
    stage.run(0.8)
    stage.mark("battery")
    stage.simulator.set_battery(stage.choose("battery", [0.25, 0.5, 0.75]))
    stage.unmute(BatteryReading)
    stage.run(1.2)
    stage.mark("imu")
    stage.unmute(ImuReading)
    # The observer drives the robot: an IMU at rest measures little.
    stage.simulator.command(0.0, 0.5)
    stage.run(0.6)
    stage.mark("near")
    stage.add_obstacle(stage.between("distance", 0.8, 1.5), bearing=stage.between("bearing", -3.0, 3.0))
    stage.run(0.6)
    stage.distort(lambda ranges: np.where(np.arange(len(ranges)) % 5 == 0, np.nan, ranges))
    stage.run(0.4)
    stage.distort(lambda ranges: np.where(np.arange(len(ranges)) % 7 == 0, BAD["below range_min"], ranges))
    stage.run(0.4)
    stage.distort(lambda ranges: np.where(np.arange(len(ranges)) % 7 == 0, LIMITS[0], ranges))
    stage.mark("at range_min")
    stage.run(0.4)
    stage.mark("end")
    # Messages still published now must carry their own time, not that of the last scan.
    stage.mute(ScanReading)
    stage.run(0.5)


@trial(serves=["F13"], node="sensor_processor", follows="standing_clock_sensor_processor")
def fine_clock(stage: Stage) -> None:
    """Let the clock go in small steps, in which also a timer that is too fast shows its rate."""
    stage.mute(ImuReading)
    stage.listen("sensor_fusion_data")
    stage.listen("obstacle_distance")
    stage.run(0.5)
    stage.measured["held"] = stage.freeze_clock(0.5)
    stage.mark("fine")
    stage.run(1.0, tick_s=0.01)
    stage.mark("end")


@trial(serves=["F12"], node="sensor_processor", follows="fusion")
def nothing_to_fuse(stage: Stage) -> None:
    """Show an obstacle, then scans without a valid reading: all out of range, and empty."""
    stage.set_range_limits(*LIMITS)
    stage.listen("sensor_fusion_data")
    stage.run(0.5)
    stage.mute(ImuReading)
    stage.add_obstacle(stage.between("distance", 0.8, 1.5), bearing=stage.between("bearing", -3.0, 3.0))
    for kind, change in (
        ("nothing in range", lambda ranges: np.where(np.arange(len(ranges)) % 7 == 0, BAD["above range_max"], np.inf)),
        ("no readings", lambda ranges: ranges[:0]),
    ):
        stage.distort(None)
        stage.run(0.4)
        stage.distort(change)
        stage.mark(kind)
        stage.run(0.5)
    stage.mark("end")


@trial(serves=["F12"], node="sensor_processor", parameters=_OTHER_SETTINGS)
def battery_runs_down(stage: Stage) -> None:
    """Drain the battery below both thresholds, which are set higher than by default."""
    stage.listen("rosout")
    # Several messages lie between a threshold and its default, so a node that uses the default is late.
    for percent in (60, 26, 24, 22, 18, 13, 12, 11, 9, 5):
        stage.simulator.set_battery(percent / 100)
        stage.run(1.1)  # one battery message a second
        stage.mute(ImuReading)  # heard by now: a hundred a second would be most of the work
    stage.mark("end")


@trial(serves=["I6"], node="sensor_processor", parameters=_OTHER_SETTINGS, follows="battery_runs_down")
def slow_fusion(stage: Stage) -> None:
    """Start the sensor processor with half the default fusion frequency."""
    stage.listen("sensor_fusion_data")
    stage.run(0.5)
    stage.mute(ImuReading)
    stage.run(2.0)
