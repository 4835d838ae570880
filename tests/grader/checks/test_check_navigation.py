"""F8: a target where the robot already is, one after others, and calls during a goal."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from helpers import judging

from grader.courses.robot_controller.checks import motion
from grader.courses.robot_controller.checks.check_navigation import again
from grader.evidence import Call, Goal, Sample, Trial

HERE = Goal(0.5, 0.0, 0.0, 0.25, True, "succeeded", True, 0.0, 0.0, ended_t=0.6)
THERE = Goal(3.4, 1.2, 0.0, 0.15, True, "succeeded", True, 1.1, 0.0, ended_t=6.0)
REJECTED = replace(HERE, accepted=False, status="rejected", success=None, ended_t=math.nan)
CANCELED = replace(HERE, t=1.1, x=1.2, status="canceled", success=False, cancel_t=2.1, ended_t=2.2)
ENDLESS = replace(HERE, status="unfinished", success=None, ended_t=math.nan)


def trial(*goals: Goal, calls: tuple[Call, ...] = ()) -> Trial:
    """Return a trial in which the robot stood until 4 s and was at x = 1.1 m from 6 s on."""
    way = [(0.0, 0.0), (4.0, 0.0), (6.0, 1.1), (7.0, 1.1)]
    samples = [Sample(t, x, 0.0, 0.0, 0.0, 0.0, x, 0.0, 0.0, 9.0) for t, x in way]
    return judging.trial("navigate_again", goals=list(goals), samples=samples, calls=list(calls))


def test_both_targets_reached_is_right():
    assert again(trial(HERE, CANCELED, THERE)) == []


@pytest.mark.parametrize(
    ("goals", "said"),
    [
        ([REJECTED, CANCELED, THERE], ["where the robot already was: it ended as rejected"]),
        ([HERE, CANCELED, replace(THERE, ended_t=3.5)], ["it ended as succeeded with success = True, 1.20 m off"]),
        ([HERE, CANCELED, replace(THERE, status="aborted", success=False)], ["others: it ended as aborted"]),
        ([HERE, REJECTED, replace(REJECTED, t=3.5)], ["that came after others: it ended as rejected"]),
        ([REJECTED, REJECTED, replace(REJECTED, t=3.5)], ["where the robot already was", "that came after others"]),
    ],
)  # fmt: skip
def test_each_target_missed_is_reported(goals: list[Goal], said: list[str]):
    found = [seen for seen, _ in again(trial(*goals))]
    assert len(found) == len(said)
    for seen, words in zip(found, said, strict=True):
        assert words in seen


def test_a_goal_that_comes_while_another_is_active_does_not_count():
    assert again(trial(HERE, ENDLESS, replace(REJECTED, t=3.5))) == []


@pytest.mark.parametrize(
    ("goals", "t", "there"),
    [([THERE], 5.0, True), ([ENDLESS], 99.0, True), ([THERE], 6.0, False), ([REJECTED], 2.0, False)],
)  # fmt: skip
def test_a_call_is_on_the_way_while_the_node_is_at_work(goals: list[Goal], t: float, there: bool):
    call = Call(t, "get_status", {}, None)
    assert motion.on_the_way(trial(*goals, calls=(call,)), "get_status") is (call if there else None)
