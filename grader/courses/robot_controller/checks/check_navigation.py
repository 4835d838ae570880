"""F8: the action navigate_to_position in an open field."""

import math

from grader.checks.judge import Failed, Judge, NotReached
from grader.evidence import Goal, Trial
from grader.words import mark, say

from . import motion

_DRIFT_M = 0.02  # by which the simulated odometry may be off after two metres, whatever the node does
_AGREE_M = 0.05  # final_pose against odometry: one tick at full speed, doubled


def test_reaches_a_target_ahead(judge: Judge) -> None:
    """`navigate_to_position` reaches a target ahead: the result says success and the robot is within `tolerance`."""
    _expect_reached(judge, "navigate_ahead")
    wrong = again(judge.trial("navigate_again", complete=False))
    if wrong:
        seen, tries = zip(*wrong, strict=True)
        judge.share(1 - len(wrong) / 3, "; ".join(seen), "; ".join(tries))


def test_reaches_a_target_beside(judge: Judge) -> None:
    """`navigate_to_position` reaches a target beside: the result says success and the robot is within `tolerance`."""
    _expect_reached(judge, "navigate_beside")


def test_reaches_a_target_behind(judge: Judge) -> None:
    """`navigate_to_position` reaches a target behind: the result says success and the robot is within `tolerance`."""
    _expect_reached(judge, "navigate_behind")


def test_final_pose_agrees_with_odometry(judge: Judge) -> None:
    """The result's `final_pose` agrees with odometry."""
    arrived = _arrived(judge)
    # The contract leaves open whether a robot drives on to the target within the tolerance; one that does may wait.
    short = judge.trial("navigate_short", complete=False)
    beside = [(short, goal) for goal in short.goals if not short.ended and _is_there(short, goal)]
    for trial, goal in [*arrived, *beside]:
        sample = motion.at(trial.samples, goal.ended_t)
        meant = motion.meant_by(trial, goal.ended_t)
        off = min(math.hypot(goal.final_x - each.odom_x, goal.final_y - each.odom_y) for each in meant)
        words = mark("final_pose ({goal.final_x:.2f}, {goal.final_y:.2f}), odom ({s.odom_x:.2f}, {s.odom_y:.2f})")
        seen = say(words, goal=goal, s=sample)
        judge.expect(off <= _AGREE_M, seen, say("fill result.final_pose from the latest odometry, not from the target"))


def test_stands_still_after_arrival(judge: Judge) -> None:
    """After arrival the robot stands still."""
    for trial, goal in _arrived(judge):
        still, last = motion.stays_still(trial.samples, goal.ended_t + 1.0), trial.samples[-1]
        words = mark("v = {last.v:.2f} m/s, omega = {last.omega:.2f} rad/s {t:.1f} s after the result")
        seen = say(words, last=last, t=last.t - goal.ended_t)
        judge.expect(still, seen, say("publish zero when the goal ends, however it ends"))
    trial = judge.trial("navigate_again", complete=False)
    if died := motion.died_after(3, judge, trial):
        judge.share(0.5, say("get_status after a goal: {died}", died=died), motion.TRY_TYPES)
    for goal in trial.goals[2:]:  # the third came after a set_speed
        last = trial.samples[-1]
        # The end of a goal that never ended is NaN, which compares False.
        if goal.ended_t + 1.5 <= last.t and not motion.stays_still(trial.samples, goal.ended_t + 1.0):
            words = mark("v = {v:.2f} m/s {t:.1f} s after a goal that came after a set_speed")
            seen = say(words, v=last.v, t=last.t - goal.ended_t)
            try_ = say("after a goal the robot stands still: forget the speed that was set before it")
            judge.share(0.5, seen, try_)


def again(trial: Trial) -> list[tuple[str, str]]:
    """Return (seen, try) of what went wrong with a target where the robot already is and with one after others.

    Of three goals the second is cancelled on the way. The contract does not say what becomes of a goal that comes
    while another one is active, so the third counts only if the second was over.
    """
    wrong = []
    goals = [*trial.goals, None, None, None]
    first, second, third = goals[:3]
    if first is not None and (seen := _shortfall(trial, first)):
        try_ = say("a goal that is already reached succeeds at once")
        wrong.append((say("a target where the robot already was: {seen}", seen=seen), try_))
    was_over = third is not None and second is not None and (not second.accepted or second.ended_t <= third.t)
    if third is not None and was_over and (seen := _shortfall(trial, third)):
        try_ = say("start each goal afresh, and keep nothing of the last one")
        wrong.append((say("a target that came after others: {seen}", seen=seen), try_))
    return wrong


def _shortfall(trial: Trial, goal: Goal) -> str:
    """Return how a goal ended, "" if the robot reached it and said so."""
    off = motion.distance_at_end(goal, trial.samples)
    if goal.success is True and goal.status == "succeeded" and off <= goal.tolerance + _DRIFT_M:
        return ""
    far = say(", {off:.2f} m off (tolerance {goal.tolerance:g} m)", off=off, goal=goal) if math.isfinite(off) else ""
    said = "" if goal.success is None else say(" with success = {goal.success}", goal=goal)
    return str(trial.ended or say("it ended as {goal.status}{said}{far}", goal=goal, said=said, far=far))


def _expect_reached(judge: Judge, name: str) -> None:
    trial = judge.trial(name)
    goal = judge.goal(trial)
    if goal.success is None:
        last = trial.samples[-1]
        left = math.hypot(goal.x - last.x, goal.y - last.y)
        seen = say("no result within 40 s; the robot is {left:.2f} m from the target", left=left)
        raise Failed(seen, say("when is the goal reached, and which line ends the action then?"))
    off = motion.distance_at_end(goal, trial.samples)
    words = mark("the goal ended as {g.status} with success = {g.success} at {g.ended_t:.1f} s, {off:.3f} m off")
    seen = say(words, g=goal, off=off)
    judge.expect(goal.success is True and goal.status == "succeeded", seen, say("set result.success, call succeed()"))
    seen = say("{seen}; the tolerance was {goal.tolerance:g} m", seen=seen, goal=goal)
    try_ = say("compare the distance with tolerance; target and pose are both in the frame odom")
    judge.expect(off <= goal.tolerance + _DRIFT_M, seen, try_)


def _arrived(judge: Judge) -> list[tuple[Trial, Goal]]:
    """Return the trials whose goal succeeded and whose robot is there by ground truth, of which there is at least one.

    A claim is no arrival: a robot that never moved stands still for certain, and where odometry says.
    """
    trials = [judge.trial(name, complete=False) for name in motion.ROUTES]
    pairs = [(trial, trial.goals[0]) for trial in trials if trial.goals and not trial.ended]
    arrived = [(trial, goal) for trial, goal in pairs if _is_there(trial, goal)]
    if not arrived:
        raise NotReached(say("no goal ended with success and the robot at its target, so there is no arrival to judge"))
    return arrived


def _is_there(trial: Trial, goal: Goal) -> bool:
    return motion.has_succeeded(goal) and motion.distance_at_end(goal, trial.samples) <= goal.tolerance + _DRIFT_M
