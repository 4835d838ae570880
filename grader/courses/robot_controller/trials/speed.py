"""Trials of the set_speed service, with speeds that float32 represents exactly."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from grader.trials.catalog import trial

from .between import at_rest

if TYPE_CHECKING:
    from grader.trials.stage import Stage

_SETTLED_S = 1.0  # 0.5 m/s at 1.0 m/s² takes half a second
_CRUISE_S = 2.0


def _cruise(stage: Stage) -> None:
    stage.run(_SETTLED_S)
    stage.mark("cruise")
    stage.run(_CRUISE_S)
    stage.mark("cruise_end")


def _limit(stage: Stage, speed: float) -> None:
    stage.call("set_speed", speed=speed)
    stage.choices["limit"] = speed
    stage.run(_SETTLED_S)
    stage.mark("at_limit")
    stage.run(1.0)
    stage.mark("at_limit_end")


@trial(serves=["F2", "F11"])
def drive_forward(stage: Stage) -> None:
    """Drive below the speed limit, at the limit, then backwards."""
    stage.run(0.5)
    stage.call("set_speed", speed=stage.choose("speed", [0.125, 0.1875, 0.25, 0.375]))
    _cruise(stage)
    _limit(stage, 0.5)
    stage.call("set_speed", speed=-0.375)
    stage.run(0.6)


@trial(serves=["F2"], follows="drive_forward", at_rest=at_rest)
def drive_backward(stage: Stage) -> None:
    """Drive backwards below the speed limit, at the limit, then stop."""
    stage.run(0.5)
    stage.call("set_speed", speed=-stage.choose("speed", [0.125, 0.1875, 0.25, 0.375]))
    _cruise(stage)
    _limit(stage, -0.5)
    stage.call("set_speed", speed=0.0)
    stage.run(1.0)
    stage.mark("stopped")
    stage.run(0.5)


@trial(serves=["F3"], follows="drive_backward", at_rest=at_rest)
def refuse_speed(stage: Stage) -> None:
    """Set a valid speed, then speeds beyond the limits, NaN and infinities."""
    stage.run(0.5)
    stage.call("set_speed", speed=stage.choose("speed", [0.125, 0.25]))
    stage.run(_SETTLED_S)
    stage.mark("refusals")
    for speed in (stage.choose("too_fast", [0.75, 1.0, 2.5]), -0.75, math.nan, math.inf, -math.inf):
        stage.call("set_speed", speed=speed)
        stage.run(0.3)
    stage.run(0.5)
    stage.mark("refusals_end")
