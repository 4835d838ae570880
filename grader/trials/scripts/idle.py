"""Trials in which nobody asks the robot for anything."""

from __future__ import annotations

from typing import TYPE_CHECKING

from grader.trials.catalog import trial
from sim.sensors import ScanReading

if TYPE_CHECKING:
    from grader.trials.stage import Stage


@trial(serves=["F1", "I3", "I4", "I5", "I6", "Q5"])
def idle(stage: Stage) -> None:
    """Five seconds without a command; the lidar begins to speak after one."""
    stage.mute(ScanReading)
    stage.run(1.0)
    stage.unmute(ScanReading)
    stage.mark("scans")
    stage.run(4.0)


@trial(serves=["I3", "I4", "I5", "I6", "Q5"], node="sensor_processor")
def idle_processor(stage: Stage) -> None:
    """The sensor processor beside a robot that stands."""
    stage.run(1.0)
