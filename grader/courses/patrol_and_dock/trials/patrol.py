"""A round, a closed corridor, a low battery. The world's goals are the places, its start is the dock."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from grader.trials.catalog import trial

if TYPE_CHECKING:
    from grader.trials.stage import Stage
    from sim import Pose, World

_NEAR_M = 0.3  # nearer than this a place is visited
_SETS_OUT_S = 1.2  # after a visit; at 0.5 m/s the robot is then 0.8 m from what closes the corridor
_STANDS = 40  # ticks without motion: the robot has come to an end


def orders(world: World) -> dict[str, object]:
    """Return the parameters `places` and `dock` for a world."""
    dock = (world.start.x, world.start.y, world.start.yaw)
    return {
        "places": [round(value, 3) for place in world.goals for value in (place.x, place.y)],
        "dock": [round(value, 4) for value in dock],
    }


class Tour:
    """The visits of a robot to the places, in their order, round after round."""

    def __init__(self, stage: Stage) -> None:
        self._stage, self._visits = stage, 0

    def until(self, visits: int, limit: float) -> None:
        """Let time pass until the robot has made so many visits, at most `limit` seconds."""
        self._stage.run_until(lambda: self._made() >= visits, limit)

    def _made(self) -> int:
        places = self._stage.simulator.world.goals
        self._visits += _distance(self._stage, places[self._visits % len(places)]) <= _NEAR_M
        return self._visits


def _distance(stage: Stage, place: Pose) -> float:
    pose = stage.simulator.pose
    return math.hypot(place.x - pose.x, place.y - pose.y)


def _has_docked(stage: Stage) -> bool:
    last = stage.recorded.samples[-_STANDS:]
    stands = all(sample.v == sample.omega == 0.0 for sample in last)
    return stands and _distance(stage, stage.simulator.world.start) < 1.0


@trial(serves=["P1", "P2", "S1", "S2", "S3"], world="ward", world_parameters=orders, takes_long=True)
def first_round(stage: Stage) -> None:
    """Patrol in a free corridor: a whole round, and the first place of the next."""
    Tour(stage).until(len(stage.simulator.world.goals) + 1, 110.0)


@trial(serves=["P3", "S1", "S2"], world="ward", world_parameters=orders, takes_long=True)
def closed_corridor(stage: Stage) -> None:
    """Close the corridor between two places when the robot has set out for the second."""
    places = len(stage.simulator.world.goals)
    closed = stage.choose("closed", [2, 3])  # visits before the corridor is closed
    tour = Tour(stage)
    tour.until(int(closed), 60.0)
    stage.run(_SETS_OUT_S)
    stage.simulator.trigger("east" if closed == 2 else "west")
    stage.mark("closed")
    tour.until(places, 130.0)


@trial(
    serves=["D1", "D2", "S1", "S2"], world="ward", world_parameters=orders, parameters={"battery_low": 30.0},
    takes_long=True,
)  # fmt: skip
def low_battery(stage: Stage) -> None:
    """Let the battery run low on patrol, and wait for the robot to stand in its dock."""
    visits = stage.choose("visits", [2, 3, 4])
    Tour(stage).until(int(visits), 80.0)
    stage.simulator.set_battery(0.25)
    stage.mark("low")
    stage.run_until(lambda: _has_docked(stage), 80.0)
    stage.run(1.0)
