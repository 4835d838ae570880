"""Trials with invalid lidar readings."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from grader.trials.catalog import trial

from .between import at_rest

if TYPE_CHECKING:
    from grader.trials.stage import Stage

SECONDS_EACH = 0.6  # six scans of each kind

LIMITS = (0.25, 10.0)  # range_min and range_max in m: other limits than the simulated lidar's own
BAD = {
    "NaN": np.nan,
    "+inf": np.inf,
    "zero": 0.0,
    "below range_min": 0.22,
    "above range_max": 11.0,
}


@trial(serves=["F6"])
def bad_readings(stage: Stage) -> None:
    """Drive with scans full of invalid readings, one kind after another."""
    stage.set_range_limits(*LIMITS)
    stage.run(0.3)
    stage.call("set_speed", speed=0.25)
    stage.run(1.0)
    for kind, value in BAD.items():
        stage.distort(lambda ranges, value=value: np.full_like(ranges, value))  # type: ignore[misc]
        stage.mark(kind)
        stage.run(SECONDS_EACH)
        stage.distort(None)
        # Let a robot that stopped speed up again, so that each kind is judged by itself.
        stage.run_until(lambda: bool(stage.commands) and stage.commands[-1].v >= 0.24, 1.5)
    stage.distort(lambda ranges: np.where(np.arange(len(ranges)) % 3 == 0, np.nan, 0.0))
    stage.mark("a mixture")
    stage.run(SECONDS_EACH)
    stage.mark("end")


@trial(serves=["F6"], follows="bad_readings", at_rest=at_rest)
def empty_scans(stage: Stage) -> None:
    """Drive with empty scans."""
    stage.run(0.3)
    stage.call("set_speed", speed=0.25)
    stage.run(1.0)
    stage.distort(lambda ranges: ranges[:0])
    stage.mark("no readings")
    stage.run(SECONDS_EACH)
    stage.mark("end")


@trial(serves=["F6"], follows="empty_scans", at_rest=at_rest)
def obstacle_among_bad_readings(stage: Stage) -> None:
    """Show an obstacle in a few good beams among many bad ones, then readings of exactly range_min."""
    stage.set_range_limits(*LIMITS)
    stage.run(0.3)
    stage.call("set_speed", speed=0.25)
    stage.run(1.0)
    kinds = np.array(list(BAD.values()))

    def spoil(ranges: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
        beams = np.arange(len(ranges))
        # The first reading is NaN; every fourth beam is left as it is.
        return np.where(beams % 4 == 2, ranges, kinds[beams % len(kinds)])

    stage.distort(spoil)
    name = stage.add_obstacle(0.45, radius=0.3)
    stage.mark("obstacle")
    stage.run(1.5)
    stage.remove_obstacle(name)
    stage.distort(lambda ranges: np.full_like(ranges, np.inf))
    stage.mark("nothing in range")
    stage.run(1.2)
    stage.distort(None)
    stage.mark("true scans")
    stage.run_until(lambda: bool(stage.commands) and stage.commands[-1].v >= 0.24, 1.5)
    stage.distort(lambda ranges: np.full_like(ranges, LIMITS[0]))
    stage.mark("at range_min")
    stage.run(SECONDS_EACH)
