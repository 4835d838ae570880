"""What happens between two trials of one life of the controller."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from grader.trials.stage import Stage


def at_rest(stage: Stage) -> bool:
    """Let the robot drive and stop; return whether it did, so that nothing of a trial before keeps it from either."""
    stage.call("set_speed", speed=0.125)
    stage.run(0.5)
    drives = stage.simulator.twist.v > 0.1
    stage.call("set_speed", speed=0.0)
    stage.run(0.3)
    return drives and stage.commands[-1].is_zero
