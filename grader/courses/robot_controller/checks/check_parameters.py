"""I6: parameters from overrides and at run time."""

import math

from grader.checks import check_parameters
from grader.checks.judge import Judge, NotReached
from grader.words import mark, say

from . import motion


def test_overrides_change_the_behaviour(judge: Judge) -> None:
    """Overriding `max_linear_speed`, `obstacle_detection_threshold` and `fusion_frequency` changes behaviour."""
    wrong, unreached = [], []
    for override in (_slow_robot, _far_sighted_robot, _slow_fusion):
        try:
            wrong += override(judge)
        except NotReached as because:
            unreached.append(because)
    if len(unreached) == 3:
        raise unreached[0]
    if wrong or unreached:
        lost = len(wrong) + len(unreached)
        seen = "; ".join([*wrong, *(say("not reached: {because}", because=because) for because in unreached)])
        judge.share(1 - lost / 3, seen, say("read the parameter where you use it, not a constant"))


def test_invalid_values_are_refused_at_run_time(judge: Judge) -> None:
    """A value that makes no sense (negative, zero rate) is refused by a parameter callback at run time."""
    check_parameters.test_invalid_values_are_refused_at_run_time(judge)
    _remark_on_a_change_without_effect(judge)


def _remark_on_a_change_without_effect(judge: Judge) -> None:
    """Say if a rate that is changed at run time is accepted, and stays what it was; the contract asks for overrides."""
    trial = judge.evidence.trials["senseless_settings_sensor_processor"]
    start = trial.marks.get("changed", math.inf) + 0.5  # a timer that is made anew takes a moment
    hertz = sum(m.t > start for m in trial.messages) / (trial.samples[-1].t - start) if math.isfinite(start) else 0.0
    if abs(hertz - 20.0) <= 2.0:
        words = mark("fusion_frequency := 10.0 changed nothing (this costs no points): data came at {hertz:.1f} Hz")
        judge.remark(say(words, hertz=hertz), say("make the timer anew when its rate changes, or refuse the change"))


def _slow_robot(judge: Judge) -> list[str]:
    trial = judge.trial("slow_robot")
    refused, accepted = (motion.answer(judge.call(trial, "set_speed", index)) for index in (0, 1))
    if refused["success"] is False and accepted["success"] is True:
        return []
    words = mark("with max_linear_speed 0.25, set_speed 0.375 answered {a[success]} and 0.1875 answered {b[success]}")
    return [say(words, a=refused, b=accepted)]


def _far_sighted_robot(judge: Judge) -> list[str]:
    trial = judge.trial("far_sighted_robot")
    judge.call(trial, "set_speed", 0)
    came, end = trial.marks["obstacle"], trial.marks["end"]
    before = motion.odometry_speed(trial.samples, came - 0.5, came)
    if before < 0.05:
        raise NotReached(say("the robot drove at {before:.2f} m/s before the obstacle came", before=before), "F2")
    last = motion.between(trial.commands, end - 0.3, end)  # F4 judges how soon it stops
    words = mark("with obstacle_detection_threshold 1.0 the robot drove on with an obstacle {distance:g} m ahead")
    return [say(words, distance=trial.choices["distance"])] if any(not command.is_zero for command in last) else []


def _slow_fusion(judge: Judge) -> list[str]:
    trial, usual = judge.trial("slow_fusion"), judge.trial("fusion")
    fused = [m.t for m in usual.messages if m.topic == "sensor_fusion_data"]
    # From the first message on: F13 judges when they begin.
    start, end = max([usual.marks["scans"] + 0.4, *fused[:1]]), usual.marks["end"]
    before = sum(start < t <= end for t in fused) / max(end - start, 0.1)
    start = max([1.0, *(m.t for m in trial.messages[:1])])
    after = sum(start < m.t <= 2.5 for m in trial.messages) / max(2.5 - start, 0.1)
    if not before:
        raise NotReached(say("no fused data came with the default fusion_frequency"), "F13")
    words = mark("fused data came at {before:.1f} Hz, and with half the fusion_frequency at {after:.1f} Hz")
    return [] if 0.4 * before <= after <= 0.6 * before else [say(words, before=before, after=after)]
