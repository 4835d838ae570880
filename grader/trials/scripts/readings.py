"""Trials with readings that are none."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from grader.trials.catalog import trial

if TYPE_CHECKING:
    from grader.trials.stage import Stage

SECONDS_EACH = 0.6  # six scans of each kind

NARROW = (0.25, 10.0)  # what a scan says of its lidar: other limits than those of the grader's robot
BAD = {
    "NaN": np.nan,
    "+inf": np.inf,
    "zero": 0.0,
    "below range_min": 0.22,
    "above range_max": 11.0,
}


@trial(serves=["F6"])
def bad_readings(stage: Stage) -> None:
    """Drive through scans full of readings that mean nothing, one kind after the other."""
    stage.set_range_limits(*NARROW)
    stage.run(0.3)
    stage.call("set_speed", speed=0.25)
    stage.run(1.0)
    for kind, value in BAD.items():
        stage.distort(lambda ranges, value=value: np.full_like(ranges, value))  # type: ignore[misc]
        stage.mark(kind)
        stage.run(SECONDS_EACH)
        stage.distort(None)
        # A robot that stopped gathers speed again, so that each kind is judged for itself.
        stage.run_until(lambda: bool(stage.commands) and stage.commands[-1].v >= 0.24, 1.5)
    stage.distort(lambda ranges: np.where(np.arange(len(ranges)) % 3 == 0, np.nan, 0.0))
    stage.mark("a mixture")
    stage.run(SECONDS_EACH)
    stage.mark("end")


@trial(serves=["F6"])
def empty_scans(stage: Stage) -> None:
    """Drive through scans that hold no readings at all."""
    stage.run(0.3)
    stage.call("set_speed", speed=0.25)
    stage.run(1.0)
    stage.distort(lambda ranges: ranges[:0])
    stage.mark("no readings")
    stage.run(SECONDS_EACH)
    stage.mark("end")


@trial(serves=["F6"])
def obstacle_among_bad_readings(stage: Stage) -> None:
    """Something stands in the way, seen by a few good beams among many bad ones; then the least that is valid."""
    stage.set_range_limits(*NARROW)
    stage.run(0.3)
    stage.call("set_speed", speed=0.25)
    stage.run(1.0)
    kinds = np.array(list(BAD.values()))

    def spoil(ranges: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
        beams = np.arange(len(ranges))
        # NaN stands first of all; every fourth beam is left as it is.
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
    stage.distort(lambda ranges: np.full_like(ranges, NARROW[0]))
    stage.mark("at range_min")
    stage.run(SECONDS_EACH)
