"""I7: the nodes follow /clock, at the same pace."""

from grader.checks.check_clock import TRY, expect_standing
from grader.checks.judge import Judge
from grader.checks.wording import place
from grader.evidence import Trial
from grader.words import mark, say

from . import motion


def test_timers_and_stamps_follow_the_clock(judge: Judge) -> None:
    """With `use_sim_time` the timers and stamps follow `/clock`."""
    expect_standing(judge)
    trial = judge.trial("standing_clock_robot_controller")
    _expect_one_pace(judge, trial)
    hertz = motion.rate(trial.commands, 0.5, trial.samples[-1].t)
    judge.expect(bool(trial.commands), say("no cmd_vel under simulated time"), TRY)
    judge.expect(hertz > 2.0, say("cmd_vel at {hertz:.1f} Hz of simulated time", hertz=hertz), TRY)
    fusion = judge.trial("fusion", complete=False)
    for message in (m for m in fusion.messages if m.topic == "sensor_fusion_data"):
        seen = say("a stamp of {t:.2f} s at {m.t:.2f} s of simulated time", t=motion.stamp(message), m=message)
        judge.expect(abs(motion.stamp(message) - message.t) < 1.0, seen, TRY)


def _expect_one_pace(judge: Judge, trial: Trial) -> None:
    """Expect the same rise of the speed whether the wall clock runs ahead of the simulated one or behind it."""
    clocks = [habit for habit in judge.habits if habit.rule == "wall-clock"]
    shown = "".join(f"; {place(habit)} {habit.text}" for habit in clocks[:3])
    # A node that does not take the zero in between has nothing to speed up from: that is F2's.
    if {"fast", "slow"} <= set(trial.marks) and all(_stands(trial, trial.marks[name]) for name in ("fast", "slow")):
        fast, slow = (_rise_s(trial, trial.marks[name]) for name in ("fast", "slow"))
        words = mark("reached the same speed in {fast:.1f} s, and in {slow:.1f} s with a slower simulator{shown}")
        judge.expect(abs(fast - slow) <= _SAME_S, say(words, fast=fast, slow=slow, shown=shown), TRY)
    # A callback that sleeps takes the time that its wall clock shows, so the two paces look alike.
    waited = trial.measured.get("waited", 0.0)
    seen = say("the node goes by another clock, and sleeps until that has gone on{shown}", shown=shown)
    judge.expect(not clocks or waited <= _SLEEPS, seen, TRY)


def _stands(trial: Trial, t: float) -> bool:
    """Return whether the last command by that time is a standstill."""
    before = [command for command in trial.commands if command.t <= t + 1e-9]
    return not before or before[-1].is_zero


def _rise_s(trial: Trial, start: float) -> float:
    """Return how long the commanded speed took to its largest value within _RISE_S, in seconds of simulated time."""
    commands = motion.between(trial.commands, start, start + _RISE_S)
    top = max((command.v for command in commands), default=0.0)
    return next((command.t - start for command in commands if command.v >= 0.95 * top), 0.0)


_RISE_S = 0.8
_SAME_S = 0.15  # more than one period of the control loop, by which threads may differ
_SLEEPS = 1.25  # of wall time for each second: then a loop of 10 Hz comes below 8 Hz
