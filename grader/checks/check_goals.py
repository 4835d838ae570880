"""F9, F10, F11: feedback, cancelling, blocked ways, limits."""

import itertools
import math

from grader.checks import motion
from grader.checks.judge import Judge, NotReached, at
from grader.evidence import Command, Goal, Trial

_ROUTES = ("navigate_ahead", "navigate_beside", "navigate_behind")
_MAX_V, _MAX_OMEGA = 0.5, 1.0  # the parameters' defaults
_ACCELERATION, _ANGULAR_ACCELERATION = 1.0, 2.0
_WINDOW_S = (0.2, 1.0)  # over which a rise is measured: one late command must not look like a jump
_DRIFT_M = 0.05  # by ground truth beyond the tolerance; how exact an arrival is F8's matter
_SILENT_S = 2.0  # four times what 2 Hz allows
# How late a command may come: a tick. Until a node is known to go by wall time, and on a busy machine, it is several.
_LATE_S = {"lockstep": 0.05, "real time": 0.3}


def test_feedback_comes_at_two_hertz(judge: Judge) -> None:
    """Feedback comes at 2 Hz or faster."""
    for trial, goal in _accepted(judge):
        end = goal.ended_t if math.isfinite(goal.ended_t) else trial.samples[-1].t
        seconds = end - goal.t
        # A timer need not fire at both ends: 2 Hz may be one message fewer.
        hertz = (len(goal.feedback) + 1) / seconds if seconds > 0 else 0.0
        seen = f"{len(goal.feedback)} feedback messages in {seconds:.1f} s of simulated time"
        judge.expect(bool(goal.feedback) and hertz >= 1.9, seen, "publish_feedback from a timer on the node's clock")
        times = [goal.t, *(entry[0] for entry in goal.feedback), end]
        start, gap = max(((a, b - a) for a, b in itertools.pairwise(times)), key=lambda pair: pair[1])
        seen = f"no feedback for {gap:.1f} s of simulated time, from {start:.1f} s on"
        judge.expect(gap <= _SILENT_S, seen, "give feedback while the robot turns or waits, too")
    blocked = judge.trial("blocked_goal", complete=False)
    start, end = blocked.marks.get("blocked", math.inf), blocked.marks.get("free", math.inf)
    waiting = blocked.goals[0] if blocked.goals and math.isfinite(end) else None
    if waiting is not None and waiting.accepted and not waiting.ended_t < end:
        times = [start, *(entry[0] for entry in waiting.feedback if start < entry[0] < end), end]
        gap = max(b - a for a, b in itertools.pairwise(times))
        if gap > _SILENT_S:
            seen = f"no feedback for {gap:.1f} s of simulated time while the way was blocked"
            judge.share(0.5, seen, "give feedback while the robot waits, too")


def test_feedback_is_the_true_distance(judge: Judge) -> None:
    """`distance_remaining` is the true distance within 0.15 m."""
    for _, goal in _accepted(judge):
        judge.expect(bool(goal.feedback), "no feedback came", "call goal_handle.publish_feedback while driving")
        t, said, true = max(goal.feedback, key=lambda entry: abs(entry[1] - entry[2]))
        seen = f"distance_remaining {said:.2f} m at {t:.1f} s, the true distance was {true:.2f} m"
        # A NaN compares False, so ask whether it is near, never whether it is far.
        near = all(abs(said - true) <= 0.15 for _, said, true in goal.feedback)
        judge.expect(near, seen, "math.hypot of the differences, from the latest odometry")


def test_a_cancelled_goal_ends_as_canceled(judge: Judge) -> None:
    """A cancelled goal ends as canceled with success = false."""
    for name in ("cancel_early", "cancel_late"):
        trial = judge.trial(name)
        goal = judge.goal(trial)
        words = f"{goal.cancel_t - goal.t:.1f} s after it began, the goal was cancelled"
        judge.expect(
            bool(goal.cancel_accepted), f"{words}; the node refused", "give the ActionServer a cancel_callback"
        )
        seen = f"{words}; it ended as {goal.status} with success = {goal.success}"
        judge.expect(goal.status == "canceled", seen, "call goal_handle.canceled() when is_cancel_requested")
        judge.expect(goal.success is False, seen, "return a result with success = False")
    blocked = _blocked_and_cancelled(judge)
    free = judge.trial("cancel_blocked", complete=False).marks.get("free", math.inf)
    if blocked is not None and not (blocked.status == "canceled" and blocked.ended_t <= free):
        after = f"{blocked.ended_t - blocked.cancel_t:.1f} s later" if math.isfinite(blocked.ended_t) else "in the end"
        seen = (
            f"cancelled while its way was blocked, the goal was {blocked.status} {after}; canceled within 1 s is right"
        )
        judge.share(0.5, seen, "look at is_cancel_requested in every cycle, while the robot waits too")


def test_stands_still_after_a_cancel(judge: Judge) -> None:
    """The robot stands still within 1 s of a cancel."""
    moved = 0
    for name in ("cancel_early", "cancel_late"):
        trial = judge.trial(name)
        goal = judge.goal(trial)
        if not _has_moved(trial, goal.cancel_t):
            continue  # one that turns gently has hardly begun when the early cancel comes
        moved += 1
        last = trial.samples[-1]
        seen = f"v = {last.v:.2f} m/s, omega = {last.omega:.2f} rad/s {last.t - goal.cancel_t:.1f} s after the cancel"
        still = motion.stays_still(trial.samples, goal.cancel_t + 1.0)
        judge.expect(still, seen, "publish zero as soon as the goal is no longer active")
    if not moved:
        raise NotReached("the robot had not begun to move when the goals were cancelled (F8)")
    blocked = _blocked_and_cancelled(judge)
    if blocked is not None and blocked.cancel_accepted:
        trial = judge.trial("cancel_blocked")
        if not motion.stays_still(trial.samples, blocked.cancel_t + 1.0):
            seen = (
                f"v = {trial.samples[-1].v:.2f} m/s 2 s after a goal was cancelled; set_speed had been called before it"
            )
            judge.share(0.5, seen, "a cancelled goal leaves a robot that stands: forget the speed that was set before")


def _blocked_and_cancelled(judge: Judge) -> Goal | None:
    """Return the goal that was cancelled while something was in its way, None if it had not begun or was given up."""
    trial = judge.trial("cancel_blocked", complete=False)
    goal = trial.goals[0] if trial.goals and not trial.ended else None
    return goal if goal is not None and goal.accepted and goal.ended_t >= goal.cancel_t else None


def test_a_blocked_goal_never_ends_in_a_collision(judge: Judge) -> None:
    """A goal whose way is blocked never ends in a collision."""
    trial, _ = _blocked(judge)
    if trial.touches:
        touch = trial.touches[0]
        seen = f"touched the {touch.obstacle} at {touch.t:.2f} s, moving at {touch.speed:.2f} m/s"
        judge.expect(False, seen, "let the obstacle stop hold during navigation too")


def test_a_blocked_goal_is_completed_once_the_way_is_free(judge: Judge) -> None:
    """A goal whose way is blocked is completed once the way is free."""
    trial, goal = _blocked(judge)
    seen = f"the goal ended as {goal.status} with success = {goal.success}"
    if math.isfinite(goal.ended_t):
        seen += f" at {goal.ended_t:.1f} s; the way was blocked from {trial.marks['blocked']:.1f} s"
    done = motion.has_succeeded(goal) and motion.distance_to(goal, trial.samples) <= goal.tolerance + _DRIFT_M
    judge.expect(done, seen, "wait before the obstacle and go on; do not give up the goal")


def test_limits_hold_throughout(judge: Judge) -> None:
    """abs(v) and abs(w) stay within their maxima, and commanded speeds rise no faster than the accelerations + 10 %."""
    for name in (*_ROUTES, "drive_forward", "wall_fast", "wall_backward", "obstacle_vanishes", "blocked_goal"):
        trial = judge.trial(name)
        if not any(not motion.is_zero(command) for command in trial.commands):
            if name in ("wall_backward", "wall_fast"):
                continue  # it may drive forwards only, or below the limit only, which is F2's matter
            raise NotReached(f"the robot never moved in the trial {name} (F2, F8)")
        for command in trial.commands:
            seen = f"v = {command.v:.3f} m/s, omega = {command.omega:.3f} rad/s at {command.t:.2f} s"
            inside = abs(command.v) <= _MAX_V + 1e-3 and abs(command.omega) <= _MAX_OMEGA + 1e-3
            judge.expect(inside, seen, "clamp both to max_linear_speed and max_angular_speed")
        for letter, unit, limit in (("v", "m/s", _ACCELERATION), ("omega", "rad/s", _ANGULAR_ACCELERATION)):
            jump = _steepest(trial.commands, letter, limit, _LATE_S[trial.pace])
            if jump is not None:
                a, b = jump
                rise = abs(getattr(b, letter)) - _base(a, b, letter)
                seen = (
                    f"{letter} rose by {rise:.2f} {unit} from {a.t:.2f} to {b.t:.2f} s; the limit is {limit:g} {unit}²"
                )
                judge.expect(False, seen, "approach the wanted speed by at most acceleration * dt in each cycle")


def _has_moved(trial: Trial, until: float) -> bool:
    """Return whether the robot had turned or driven by more than a little."""
    before = [sample for sample in trial.samples if sample.t <= until]
    return bool(before) and math.dist(*((s.x, s.y, s.yaw) for s in (before[0], before[-1]))) >= 0.05


def _steepest(commands: list[Command], letter: str, limit: float, late: float) -> tuple[Command, Command] | None:
    """Return two commands between which a speed rose faster than `limit` + 10 %, None if there are none.

    Each of them may have come up to `late` seconds after its time.
    """
    commands = _extremes(commands, letter)
    for i, a in enumerate(commands):
        for b in commands[i + 1 :]:
            dt = b.t - a.t
            if dt > _WINDOW_S[1]:
                break
            if dt < _WINDOW_S[0] - 1e-9:
                continue
            if abs(getattr(b, letter)) - _base(a, b, letter) > limit * (1.1 * dt + late) + 1e-6:
                return a, b
    return None


def _extremes(commands: list[Command], letter: str) -> list[Command]:
    """Return of the commands of each moment the slowest and the fastest: a thousand of them say no more."""
    kept = []
    for _, together in itertools.groupby(commands, key=lambda command: command.t):
        ordered = sorted(together, key=lambda command: abs(getattr(command, letter)))
        kept += [ordered[0], ordered[-1]][: len(ordered)]
    return kept


def _base(a: Command, b: Command, letter: str) -> float:
    """Return the speed from which b's counts: a's, or 0 if the robot changed its direction in between."""
    first, second = getattr(a, letter), getattr(b, letter)
    return abs(first) if first * second > 0 else 0.0


def _accepted(judge: Judge) -> list[tuple[Trial, Goal]]:
    trials = [judge.trial(name) for name in _ROUTES]
    return [(trial, judge.goal(trial)) for trial in trials]


def _blocked(judge: Judge) -> tuple[Trial, Goal]:
    trial = judge.trial("blocked_goal")
    goal = judge.goal(trial)
    start, there = trial.samples[0], at(trial.samples, trial.marks["blocked"])
    if math.hypot(there.x - start.x, there.y - start.y) < 0.1:
        raise NotReached("the robot had not begun to drive when the way was blocked (F8)")
    return trial, goal
