"""P1 to P3, D1, D2 and S1 to S3: the robot visits its places, comes back to the dock, and drives safely."""

from __future__ import annotations

import itertools
import math

from grader.checks.judge import Failed, Judge, NotReached
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


def expect_a_round(judge: Judge, name: str) -> None:
    """Give the share of the places that the robot has visited in a trial."""
    trial = judge.trial(name, complete=False)
    places, made = len(trial.scene["goals"]), len(visits(trial))
    if made < places:
        judge.share(made / places, f"visited {made} of {places} places in {trial.samples[-1].t:.0f} s", "")


def test_visits_every_place(judge: Judge) -> None:
    """The robot visits the places of the list in their order."""
    expect_a_round(judge, "first_round")


def test_begins_the_next_round(judge: Judge) -> None:
    """After the last place the robot goes on with the first."""
    trial, places, times = _round(judge)
    judge.expect(len(times) > places, f"did not come to the first place again in {trial.samples[-1].t:.0f} s", "")


def _round(judge: Judge) -> tuple[Trial, int, list[float]]:
    """Return the trial of a round, the number of places and the times of the visits, of a robot that made the round."""
    trial = judge.trial("first_round", complete=False)
    places, times = len(trial.scene["goals"]), visits(trial)
    if len(times) < places:
        raise NotReached("the first round was not finished", "P1")
    return trial, places, times


def test_visits_the_places_behind_a_closed_corridor(judge: Judge) -> None:
    """When the corridor is closed on the way to a place, the robot visits that place and those after it."""
    trial = judge.trial("closed_corridor", complete=False)
    places, times = len(trial.scene["goals"]), visits(trial)
    before = int(trial.choices["closed"])
    if len(times) < before:
        raise NotReached("the robot did not come to the place before which the corridor is closed", "P1")
    made, left = len(times) - before, places - before
    seen = f"the corridor was closed at {trial.marks['closed']:.0f} s; then visited {made} of {left} places"
    if made < left:
        judge.share(made / left, f"{seen} until {trial.samples[-1].t:.0f} s", "")


_CLEARANCE_M, _ROUND_S = 0.1, 60.0


def test_touches_nothing(judge: Judge) -> None:
    """The robot never touches anything."""
    for trial in [drove(judge, name) for name in TRIALS]:
        if trial.touches:
            touch = trial.touches[0]
            raise Failed(f"touched {touch.obstacle} at {touch.t:.1f} s, at {touch.speed:.2f} m/s", "")


def test_keeps_its_distance(judge: Judge) -> None:
    """The robot's hull keeps a distance of 0.1 m from everything."""
    trials = [drove(judge, name) for name in TRIALS]
    nearest = min((sample for trial in trials for sample in trial.samples), key=lambda sample: sample.clearance)
    judge.figure("clearance", nearest.clearance)
    judge.expect(nearest.clearance >= _CLEARANCE_M, f"{nearest.clearance:.2f} m at {nearest.t:.0f} s", "")


def test_is_quick(judge: Judge) -> None:
    """The first round takes 60 s at most."""
    trial, places, times = _round(judge)
    end = times[places - 1]
    judge.figure("time", end)
    judge.figure("distance", driven(trial.samples, end))
    judge.expect(end <= _ROUND_S, f"the round took {end:.0f} s", "")


_BACK_M, _DOCK_M, _DOCK_DEG = 0.5, 0.1, 10.0


def test_comes_back(judge: Judge) -> None:
    """When the battery is below `battery_low`, the robot leaves its patrol and comes back to the dock."""
    trial = _sent_back(judge)
    off, _ = from_dock(trial)
    seen = f"the battery was low at {trial.marks['low']:.0f} s, and the robot {off:.2f} m from the dock in the end"
    judge.expect(off <= _BACK_M, seen, "")


def test_stands_at_the_dock(judge: Judge) -> None:
    """The robot stands still within 0.1 m of the dock."""
    trial = _back(judge)
    off, end = from_dock(trial)[0], trial.samples[-1]
    judge.expect(end.v == 0.0 and end.omega == 0.0, f"still moved at {end.t:.0f} s, {off:.2f} m from the dock", "")
    judge.expect(off <= _DOCK_M, f"stood {off:.2f} m from the dock", "")


def test_faces_as_the_dock_does(judge: Judge) -> None:
    """The robot stands within 10 degrees of the dock's heading."""
    turned = from_dock(_back(judge))[1]
    judge.expect(turned <= _DOCK_DEG, f"stood {turned:.0f} degrees off the dock's heading", "")


def _sent_back(judge: Judge) -> Trial:
    trial = judge.trial("low_battery", complete=False)
    if "low" not in trial.marks or len(visits(trial)) < int(trial.choices["visits"]):
        raise NotReached("the robot was not on patrol when the battery ran low", "P1")
    return trial


def _back(judge: Judge) -> Trial:
    trial = _sent_back(judge)
    if not from_dock(trial)[0] <= _BACK_M:
        raise NotReached("the robot did not come back", "D1")
    return trial
