"""F1 and I7: a control loop that sleeps, and one that goes by another clock; which of the two it is."""

from __future__ import annotations

from dataclasses import replace

from helpers import recordings
from helpers.judging import ask, find, with_trials

from grader.evidence import Evidence, Finding

RATE = find("check_idle::test_publishes_at_the_control_rate")
CLOCK = find("check_clock::test_timers_and_stamps_follow_the_clock")
PACKAGE = "ros2_robot_controller/driver.py"
ASKS = Finding(PACKAGE, 70, "wall-clock", "`time.time` in `_now`, called from the callback `_control`")
SLEEPS = Finding(PACKAGE, 103, "sleep-in-callback", "`time.sleep` in the callback `_control`")


def with_habits(*habits: Finding, waited: float = 0.0) -> Evidence:
    """Return the reference's evidence with these lines in its text, and with a clock that waited for its callbacks."""
    evidence = recordings.load("reference")
    assert evidence.quality is not None
    trials = {
        name: replace(trial, measured=trial.measured | {"waited": waited}) for name, trial in evidence.trials.items()
    }
    return replace(evidence, trials=trials, quality=replace(evidence.quality, habits=list(habits)))


def test_a_loop_that_sleeps_is_too_slow_for_a_robot() -> None:
    """0.3 s in the control callback: the simulator's clock waited, so that it came at 10 Hz by that clock."""
    said = ask(RATE, with_habits(SLEEPS, waited=3.0))
    assert said.share == 0
    assert said.seen.startswith("the control loop sleeps: on a robot cmd_vel would come at 3.")
    assert f"{PACKAGE}:103 `time.sleep` in the callback `_control`" in said.seen
    assert ask(RATE, with_habits(SLEEPS, waited=1.2)).share == 1  # full points at 8 Hz: 1.25 s for each second


def test_a_loop_that_sleeps_and_asks_another_clock_is_told_of_both() -> None:
    assert ask(RATE, with_habits(ASKS, SLEEPS, waited=3.0)).share == 0
    said = ask(CLOCK, with_habits(ASKS, SLEEPS, waited=3.0))
    assert said.share == 0
    assert said.seen == (
        "the node goes by another clock, and sleeps until that has gone on; "
        f"{PACKAGE}:70 `time.time` in `_now`, called from the callback `_control`"
    )


def test_a_loop_that_only_sleeps_keeps_i7_and_a_stopwatch_costs_nothing() -> None:
    assert ask(CLOCK, with_habits(SLEEPS, waited=3.0)).share == 1
    assert ask(CLOCK, with_habits(ASKS)).share == 1


def test_a_speed_that_rises_by_the_wall_clock_costs_i7() -> None:
    evidence = with_habits(ASKS)
    trial = evidence.trials["standing_clock_robot_controller"]
    late = trial.marks["slow"]
    # What a robot does whose steps are measured by a wall clock that runs four times as fast: it jumps.
    jump = [replace(c, v=0.5) if late < c.t < late + 0.8 else c for c in trial.commands]
    said = ask(CLOCK, with_trials(evidence, replace(trial, commands=jump)))
    assert said.share == 0
    assert said.seen.startswith("reached the same speed in 0.5 s, and in 0.1 s with a slower simulator")


def test_a_speed_that_a_zero_does_not_end_is_no_matter_of_the_clock() -> None:
    """A set_speed that ignores 0 drove on between the two paces, and cost I7 beside F2."""
    evidence = with_habits()
    trial = evidence.trials["standing_clock_robot_controller"]
    top = max(command.v for command in trial.commands)
    rose = next(command.t for command in trial.commands if command.v == top)
    drives_on = [replace(command, v=top) if command.t > rose else command for command in trial.commands]
    said = ask(CLOCK, with_trials(evidence, replace(trial, commands=drives_on)))
    assert said.share == 1
