"""What the trials of a patrol show: visits, the way driven, the dock. Pure functions over evidence."""

from __future__ import annotations

import itertools
import math

from grader.checks.judge import Judge, NotReached
from grader.evidence import Sample, Trial

TRIALS = ("first_round", "closed_corridor", "low_battery")
NEAR_M = 0.3


def visits(trial: Trial) -> list[float]:
    """Return the times at which the robot came to the places, in their order, round after round."""
    places, found = trial.scene["goals"], list[float]()
    for sample in trial.samples:
        place = places[len(found) % len(places)]
        if math.hypot(place["x"] - sample.x, place["y"] - sample.y) <= NEAR_M:
            found.append(sample.t)
    return found


def driven(samples: list[Sample], until: float = math.inf) -> float:
    """Return the length of the way that the robot has driven until a time, in m."""
    way = [sample for sample in samples if sample.t <= until]
    return math.fsum(math.hypot(b.x - a.x, b.y - a.y) for a, b in itertools.pairwise(way))


def from_dock(trial: Trial) -> tuple[float, float]:
    """Return how far the robot is from its dock at the end: in m, and in degrees."""
    dock, end = trial.scene["start"], trial.samples[-1]
    turned = math.degrees(abs(math.remainder(end.yaw - dock["yaw"], math.tau)))
    return math.hypot(end.x - dock["x"], end.y - dock["y"]), turned


def drove(judge: Judge, name: str) -> Trial:
    """Return a trial in which the robot drove for a metre at least, however it ended.

    Raises:
        NotReached: it did not.
    """
    trial = judge.trial(name, complete=False)
    if driven(trial.samples) < 1.0:
        raise NotReached("the robot did not set out", "P1")
    return trial
