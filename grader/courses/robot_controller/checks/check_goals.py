"""F9 to F11: feedback, cancelling, blocked ways."""

import itertools
import math

from grader.checks.judge import Failed, Judge, NotReached
from grader.evidence import Goal, Trial
from grader.words import mark, say

from . import motion

_DRIFT_M = 0.05  # beyond the tolerance, by ground truth; F8 judges how exact an arrival is
_ON_THE_WAY_M = 0.3  # from here on a distance that stays the same is wrong by more than 0.15 m
_NEAR_M = 0.15  # by which `distance_remaining` may be off
_SILENT_S = 2.0  # four times the gap at 2 Hz


def test_feedback_comes_at_two_hertz(judge: Judge) -> None:
    """Feedback comes at 2 Hz or faster."""
    for trial, goal in _accepted(judge):
        end = goal.ended_t if math.isfinite(goal.ended_t) else trial.samples[-1].t
        seconds = end - goal.t
        # A timer need not fire at both ends, so 2 Hz may be one message fewer.
        hertz = (len(goal.feedback) + 1) / seconds if seconds > 0 else 0.0
        seen = say("{n} feedback messages in {seconds:.1f} s of simulated time", n=len(goal.feedback), seconds=seconds)
        try_ = say("publish_feedback from a timer on the node's clock")
        judge.expect(bool(goal.feedback) and hertz >= 1.9, seen, try_)
        times = [goal.t, *(entry[0] for entry in goal.feedback), end]
        start, gap = max(((a, b - a) for a, b in itertools.pairwise(times)), key=lambda pair: pair[1])
        seen = say("no feedback for {gap:.1f} s of simulated time, from {start:.1f} s on", gap=gap, start=start)
        judge.expect(gap <= _SILENT_S, seen, say("publish feedback also while the robot turns or waits"))
    blocked = judge.trial("blocked_goal", complete=False)
    start, end = blocked.marks.get("blocked", math.inf), blocked.marks.get("free", math.inf)
    waiting = blocked.goals[0] if blocked.goals and math.isfinite(end) else None
    if waiting is not None and waiting.accepted and not waiting.ended_t < end:
        times = [start, *(entry[0] for entry in waiting.feedback if start < entry[0] < end), end]
        gap = max(b - a for a, b in itertools.pairwise(times))
        if gap > _SILENT_S:
            seen = say("no feedback for {gap:.1f} s of simulated time while the way was blocked", gap=gap)
            judge.share(0.5, seen, say("publish feedback while the robot waits, too"))


def test_feedback_is_the_true_distance(judge: Judge) -> None:
    """`distance_remaining` is the true distance within 0.15 m."""
    for trial, goal in _accepted(judge):
        try_ = say("call goal_handle.publish_feedback while driving")
        judge.expect(bool(goal.feedback), say("no feedback came"), try_)
        # NaN compares False, so ask whether it is near, never whether it is far.
        wrong = [entry for entry in goal.feedback if not _is_near(trial, goal, *entry)]
        t, said, true = max(wrong or goal.feedback, key=lambda entry: abs(entry[1] - entry[2]))
        words = mark("distance_remaining {said:.2f} m at {t:.1f} s, the true distance was {true:.2f} m")
        seen = say(words, said=said, t=t, true=true)
        judge.expect(not wrong, seen, say("math.hypot of the differences in x and y, from the latest odometry"))


def test_a_cancelled_goal_ends_as_canceled(judge: Judge) -> None:
    """A cancelled goal ends as canceled with success = false."""
    for name in ("cancel_early", "cancel_late"):
        trial = judge.trial(name)
        goal = judge.goal(trial)
        words = say("the goal was cancelled {cancel_t:.1f} s after its start", cancel_t=goal.cancel_t - goal.t)
        seen = say("{words}; the node refused", words=words)
        judge.expect(bool(goal.cancel_accepted), seen, say("give the ActionServer a cancel_callback"))
        seen = say("{words}; it ended as {goal.status} with success = {goal.success}", words=words, goal=goal)
        judge.expect(goal.status == "canceled", seen, say("call goal_handle.canceled() when is_cancel_requested"))
        judge.expect(goal.success is False, seen, say("return a result with success = False"))
    blocked = _blocked_and_cancelled(judge)
    free = judge.trial("cancel_blocked", complete=False).marks.get("free", math.inf)
    if blocked is not None and not (blocked.status == "canceled" and blocked.ended_t <= free):
        words = mark("cancelled while its way was blocked, the goal was {status} in the end, not canceled within 1 s")
        try_ = say("look at is_cancel_requested in every cycle, while the robot waits, too")
        judge.share(0.5, say(words, status=blocked.status), try_)


def test_stands_still_after_a_cancel(judge: Judge) -> None:
    """The robot stands still within 1 s of a cancel."""
    moved = 0
    for name in ("cancel_early", "cancel_late"):
        trial = judge.trial(name)
        goal = judge.goal(trial)
        if not goal.cancel_accepted:
            raise NotReached(say("the node refused to cancel, so there is no cancelled goal to judge"))
        if not _has_moved(trial, goal.cancel_t):
            continue  # a robot that turns gently has hardly begun when the early cancel comes
        moved += 1
        last = trial.samples[-1]
        words = mark("v = {last.v:.2f} m/s, omega = {last.omega:.2f} rad/s {t:.1f} s after the cancel")
        seen = say(words, last=last, t=last.t - goal.cancel_t)
        still = motion.stays_still(trial.samples, goal.cancel_t + 1.0)
        judge.expect(still, seen, say("publish zero as soon as the goal is no longer active"))
    if not moved:
        raise NotReached(say("the robot had not begun to move when the goals were cancelled"), "F8")
    blocked = _blocked_and_cancelled(judge)
    if blocked is not None and blocked.cancel_accepted:
        trial = judge.trial("cancel_blocked")
        if not motion.stays_still(trial.samples, blocked.cancel_t + 1.0):
            words = mark("v = {v:.2f} m/s 2 s after a goal was cancelled that came after a set_speed")
            seen = say(words, v=trial.samples[-1].v)
            try_ = say("after a cancelled goal the robot stands still: forget the speed that was set before it")
            judge.share(0.5, seen, try_)


def test_a_blocked_goal_never_ends_in_a_collision(judge: Judge) -> None:
    """A goal whose way is blocked never ends in a collision."""
    trial, goal = _blocked(judge)
    if trial.touches:
        touch = trial.touches[0]
        seen = say("touched the {touch.obstacle} at {touch.t:.2f} s, moving at {touch.speed:.2f} m/s", touch=touch)
        raise Failed(seen, say("stop for obstacles during navigation, too"))
    if motion.has_succeeded(goal) and goal.ended_t < trial.marks["free"] and not _was_reached(trial, goal):
        raise NotReached(say("the goal was called reached before the robot was there, so nothing blocked its way"))


def test_a_blocked_goal_is_completed_once_the_way_is_free(judge: Judge) -> None:
    """A goal whose way is blocked is completed once the way is free."""
    trial, goal = _blocked(judge)
    seen = say("the goal ended as {goal.status} with success = {goal.success}", goal=goal)
    if math.isfinite(goal.ended_t):
        words = mark(" at {goal.ended_t:.1f} s, {off:.2f} m off; the way was blocked from {since:.1f} s")
        off = motion.distance_at_end(goal, trial.samples)
        seen += say(words, goal=goal, off=off, since=trial.marks["blocked"])
    done = motion.has_succeeded(goal) and _was_reached(trial, goal)
    judge.expect(done, seen, say("wait before the obstacle and then go on; do not give up the goal"))


def _was_reached(trial: Trial, goal: Goal) -> bool:
    return motion.distance_at_end(goal, trial.samples) <= goal.tolerance + _DRIFT_M


def _has_moved(trial: Trial, until: float) -> bool:
    """Return whether the robot had turned or driven noticeably before the time `until`."""
    before = [sample for sample in trial.samples if sample.t <= until]
    return bool(before) and math.dist(*((s.x, s.y, s.yaw) for s in (before[0], before[-1]))) >= 0.05


def _is_near(trial: Trial, goal: Goal, t: float, said: float, true: float) -> bool:
    """Return whether a distance that came at time `t` is the true one, or was so when it may have been sent."""
    earlier = (math.hypot(goal.x - sample.x, goal.y - sample.y) for sample in motion.meant_by(trial, t))
    return any(abs(said - distance) <= _NEAR_M for distance in (true, *earlier))


def _accepted(judge: Judge) -> list[tuple[Trial, Goal]]:
    trials = [judge.trial(name) for name in motion.ROUTES]
    pairs = [(trial, judge.goal(trial)) for trial in trials]
    if not any(motion.reach(trial.samples, goal.t, goal.ended_t) >= _ON_THE_WAY_M for trial, goal in pairs):
        raise NotReached(say("the robot never moved towards a target, so there was no way to report on"), "F8")
    return pairs


def _blocked(judge: Judge) -> tuple[Trial, Goal]:
    trial = judge.trial("blocked_goal")
    goal = judge.goal(trial)
    start, blocked = trial.samples[0], motion.at(trial.samples, trial.marks["blocked"])
    if math.hypot(blocked.x - start.x, blocked.y - start.y) < 0.1:
        raise NotReached(say("the robot had not begun to drive when the way was blocked"), "F8")
    return trial, goal


def _blocked_and_cancelled(judge: Judge) -> Goal | None:
    """Return the goal that was cancelled while its way was blocked, None if it had not begun or had ended before."""
    trial = judge.trial("cancel_blocked", complete=False)
    goal = trial.goals[0] if trial.goals and not trial.ended else None
    return goal if goal is not None and goal.accepted and goal.ended_t >= goal.cancel_t else None
