"""I6 and Q4: a number in the code shows in a trial with other settings; what does neither is judged elsewhere."""

from __future__ import annotations

from dataclasses import replace

import pytest
from helpers import judging, recordings
from helpers.judging import ask, find, with_trials

from grader.courses.robot_controller.checks.check_habits import without_effect
from grader.courses.robot_controller.trials.parameters import OTHER_SETTINGS
from grader.evidence import Command, Message, Trial

OVERRIDES = find("check_parameters::test_overrides_change_the_behaviour")
REFUSED = find("check_parameters::test_invalid_values_are_refused_at_run_time")
MARKS = {"idle": 0.5, "start": 1.5, "ahead": 3.0, "slowed": 3.4, "beside": 4.0, "gone": 4.7, "goal": 5.0, "end": 7.0}


def trial(
    *, hertz: float = 20.0, acceleration: float = 0.5, slow: float = 0.25, stops: bool = True, omega: float = 0.5,
    turning_up: float = 0.5, pace: str = "lockstep",
) -> Trial:  # fmt: skip
    """Return what a robot does in the trial that obeys the settings but for the arguments given."""
    commands = []
    for n in range(1, round(7.0 * hertz)):
        t = n / hertz
        v = min(0.4375, acceleration * max(0.0, t - MARKS["start"]))
        if MARKS["ahead"] < t <= MARKS["slowed"]:
            v = slow
        if MARKS["slowed"] < t:
            v = 0.0 if stops and t > MARKS["beside"] else 0.125
        turn = min(omega, turning_up * max(0.0, t - MARKS["goal"]))
        commands.append(Command(t, v if t <= MARKS["goal"] else 0.0, turn, 0.0))
    return judging.trial("other_settings", pace=pace, commands=commands, marks=MARKS, choices=dict(OTHER_SETTINGS))


def test_a_robot_that_obeys_its_settings_has_none_without_effect():
    assert without_effect(trial()) == {}


@pytest.mark.parametrize(
    ("robot", "name", "said"),
    [
        (trial(hertz=10.0), "laser_processing_rate", "with laser_processing_rate = 20, cmd_vel still came at 10.0 Hz"),
        (trial(acceleration=1.0), "linear_acceleration", "v still rose as fast as with 1"),
        (trial(turning_up=2.0), "angular_acceleration", "omega still rose as fast as with 2"),
        (trial(omega=1.0), "max_angular_speed", "the robot still turned at 0.98 rad/s"),
        (trial(stops=False), "emergency_stop_distance", "the robot drove on with an obstacle 0.3 m away"),
        (trial(slow=0.4375), "safety_margin", "with safety_margin = 1, the robot drove on at 0.44 m/s"),
    ],
)
def test_a_number_in_the_code_is_found(robot: Trial, name: str, said: str):
    found = without_effect(robot)
    assert list(found) == [name]
    assert said in found[name]


@pytest.mark.parametrize(
    "robot",
    [trial(acceleration=20.0), trial(turning_up=40.0), trial(omega=3.0, turning_up=40.0), trial(hertz=40.0)],
    ids=["no acceleration", "no angular acceleration", "no limit of turning", "a rate of its own"],
)
def test_what_another_requirement_judges_is_not_charged_twice(robot: Trial):
    assert without_effect(robot) == {}


@pytest.mark.parametrize(
    ("mark", "shown"),
    [("slowed", []), ("beside", ["safety_margin"]), ("end", ["emergency_stop_distance", "safety_margin"])],
)
def test_a_trial_that_ended_early_shows_nothing_of_the_rest(mark: str, shown: list[str]):
    whole, until = trial(stops=False, slow=0.4375), MARKS[mark]
    kept = {name: t for name, t in MARKS.items() if t < until}
    short = replace(whole, marks=kept, commands=[c for c in whole.commands if c.t < until])
    assert list(without_effect(short)) == shown


@pytest.mark.parametrize("robot", [trial(slow=0.4), trial(slow=0.0), trial(turning_up=2.0, pace="real time")])
def test_a_correct_package_that_does_it_its_own_way_is_not_charged(robot: Trial):
    """How much slower is left open, and an action loop on wall time keeps no acceleration of simulated time."""
    assert without_effect(robot) == {}


def test_a_rate_that_stays_the_same_when_it_is_changed_is_remarked_and_costs_nothing():
    """The contract asks for overrides; that a node accepts a change and ignores it should be known all the same."""
    evidence = recordings.load("reference")
    trial = evidence.trials["senseless_settings_sensor_processor"]
    end = trial.samples[-1].t
    samples = [replace(sample, t=sample.t + 2.1 - end) for sample in trial.samples]  # to 2.1 s: 1.5 s to look at
    told = replace(trial, marks={"changed": 0.1}, samples=samples)
    every = [Message(0.1 + n * 0.05, "sensor_fusion_data", {}) for n in range(1, 41)]
    stays, follows = (ask(REFUSED, with_trials(evidence, replace(told, messages=m))) for m in (every, every[::2]))
    assert stays.share == follows.share == 1
    assert stays.seen == "fusion_frequency := 10.0 changed nothing (this costs no points): data came at 20.0 Hz"
    assert follows.seen == ""


@pytest.mark.parametrize(("v", "share"), [(0.25, 2 / 3), (0.03, 2 / 3), (0.0, 1)])
def test_a_robot_that_only_slows_down_between_the_default_threshold_and_the_one_set_is_charged(v: float, share: float):
    """It slowed down by the parameter and stopped by a number: a wall that it approached did not show that."""
    evidence = recordings.load("reference")
    trial = evidence.trials["far_sighted_robot"]
    commands = [replace(c, v=v) if c.t > trial.marks["obstacle"] + 0.4 else c for c in trial.commands]
    answer = ask(OVERRIDES, with_trials(evidence, replace(trial, commands=commands)))
    assert answer.share == pytest.approx(share)
    assert ("the robot drove on with an obstacle 0.8" in answer.seen) is (share < 1)
