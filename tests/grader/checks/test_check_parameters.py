"""I6: whether the obstacle threshold is the parameter's value, and not a number in the code."""

from __future__ import annotations

from dataclasses import replace

import pytest
from helpers import recordings
from helpers.judging import ask, find, with_trials

OVERRIDES = find("check_parameters::test_overrides_change_the_behaviour")


@pytest.mark.parametrize(("v", "share"), [(0.25, 2 / 3), (0.03, 2 / 3), (0.0, 1)])
def test_a_robot_that_only_slows_down_between_the_default_threshold_and_the_one_set_is_charged(v: float, share: float):
    """It slowed down by the parameter and stopped by a number: a wall that it approached did not show that."""
    evidence = recordings.load("reference")
    trial = evidence.trials["far_sighted_robot"]
    commands = [replace(c, v=v) if c.t > trial.marks["obstacle"] + 0.4 else c for c in trial.commands]
    answer = ask(OVERRIDES, with_trials(evidence, replace(trial, commands=commands)))
    assert answer.share == pytest.approx(share)
    assert ("the robot drove on with an obstacle 0.8" in answer.seen) is (share < 1)
