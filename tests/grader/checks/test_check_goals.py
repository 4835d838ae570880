"""F9: whether `distance_remaining` is true, of a node in lockstep and of one on wall time."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from helpers import recordings
from helpers.course import COURSE

from grader.checks.judge import Failed, Judge
from grader.courses.robot_controller.checks.check_goals import test_feedback_is_the_true_distance as distance_is_true
from grader.evidence import Trial

REFERENCE = recordings.load("reference")
NAME = "navigate_ahead"


def judge(pace: str, late_s: float = 0.0, off_m: float = 0.0) -> Judge:
    """Return the reference's evidence with the feedback of one trial `late_s` later and `off_m` off."""
    trial = REFERENCE.trials[NAME]
    (goal,) = trial.goals
    feedback = [[t, said + off_m, distance(trial, t + late_s)] for t, said, _ in goal.feedback]
    feedback = [[t + late_s, said, true] for t, said, true in feedback]
    changed = replace(trial, pace=pace, goals=[replace(goal, feedback=feedback)])
    return Judge(replace(REFERENCE, trials=REFERENCE.trials | {NAME: changed}), COURSE)


def distance(trial: Trial, t: float) -> float:
    (goal,) = trial.goals
    sample = min(trial.samples, key=lambda sample: abs(sample.t - t))
    return math.hypot(goal.x - sample.x, goal.y - sample.y)


@pytest.mark.parametrize("pace", ["lockstep", "real time"])
def test_true_distances_are_right(pace: str):
    distance_is_true(judge(pace))


def test_a_message_of_a_node_on_wall_time_may_come_late():
    """On a busy machine 0.35 s of scheduling cost a node a point whose distances were true."""
    distance_is_true(judge("real time", late_s=0.4))
    with pytest.raises(Failed):
        distance_is_true(judge("lockstep", late_s=0.4))


@pytest.mark.parametrize(("pace", "late_s"), [("lockstep", 0.0), ("real time", 0.0), ("real time", 1.5)])
@pytest.mark.parametrize("off_m", [0.35, -0.35, math.nan])
def test_a_wrong_distance_fails_at_any_pace(pace: str, late_s: float, off_m: float):
    with pytest.raises(Failed, match="distance_remaining"):
        distance_is_true(judge(pace, late_s, off_m))
