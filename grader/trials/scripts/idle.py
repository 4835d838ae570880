"""Trials without any command."""

from __future__ import annotations

from typing import TYPE_CHECKING

from grader.trials.catalog import trial
from sim.sensors import ScanReading

if TYPE_CHECKING:
    from grader.trials.stage import Stage


@trial(serves=["F1", "I3", "I4", "I5", "I6", "Q5"])
def idle(stage: Stage) -> None:
    """Wait five seconds without a command; the lidar starts after one second."""
    stage.mute(ScanReading)
    stage.run(1.0)
    stage.unmute(ScanReading)
    stage.mark("scans")
    stage.run(4.0)


@trial(serves=["I3", "I4", "I5", "I6", "Q5"], node="sensor_processor")
def idle_processor(stage: Stage) -> None:
    """Run the sensor processor while the robot stands still."""
    stage.run(1.0)
