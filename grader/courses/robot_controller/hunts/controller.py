"""What the controller promises in every case. What the contract leaves open breaks no promise."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator

from grader.checks import check_interrupt
from grader.courses.robot_controller.checks import check_limits, check_set_speed, check_status, motion
from grader.evidence import Call, Command, Goal
from grader.tracebacks import BEGIN
from grader.trials.promises import Broken, Run, broken, promise
from grader.words import mark

NODE = "robot_controller"
_DEFAULTS = motion.DEFAULTS
_WITHIN_S = 0.35  # 0.3 s by the contract, and one tick
_NOISE = 0.02  # of a reading of half a metre, twice its standard deviation
_MOVES = 0.02  # m/s: less is a twitch at the edge of the sector
_AGREES_M, _AGREES_RAD = 0.1, 0.2
_DRIFT_M = 0.05


# -- what is promised --------------------------------------------------------------------------------------------------
@promise("F4", "F11")
def never_touches(run: Run) -> Broken | None:
    """It touches nothing that it could have seen in time."""
    for touch in run.trial.touches:
        if abs(touch.speed) > _MOVES and _near_for(run, touch.t, run.sample(touch.t - 0.05).v):
            return broken(touch.t, mark("touched {touch.obstacle} at {t:.2f} s, at {touch.speed:.2f} m/s"), touch=touch)
    return None


@promise("F4")
def stops_in_time(run: Run) -> Broken | None:
    """It does not drive on for more than 0.3 s towards what is nearer than `obstacle_detection_threshold`."""
    for t, command in _in_force_at(run):
        if not abs(command.v) <= _MOVES and (near := _near_for(run, t, command.v)):
            words = mark("still {v:.2f} m/s at {t:.2f} s, {late:.2f} s after a scan read {near:.2f} m in the way")
            return broken(t, words, v=command.v, late=t - near[0], near=near[1])
    return None


@promise("F4")
def stands_in_an_emergency(run: Run) -> Broken | None:
    """Nearer than `emergency_stop_distance` to anything it commands zero for everything."""
    for t, command in _in_force_at(run):
        least = _value(run, "emergency_stop_distance", t)
        if not command.is_zero and (near := _all_below(run, t, "anywhere", least - _NOISE / 2)):
            words = mark("{c.v:.2f} m/s, {c.omega:.2f} rad/s at {t:.2f} s, {late:.2f} s after a scan of {near:.2f} m")
            return broken(t, words, c=command, late=t - near[0], near=near[1])
    return None


@promise("F1")
def stands_without_a_command(run: Run) -> Broken | None:
    """Before the first request it commands zero, at the control loop's rate."""
    asked = [t for name in ("call", "goal", "set") for t, _ in run.times(name)]
    until = min([*asked, run.end])
    before = run.commands(0.0, until)
    if moving := next((command for command in before if not command.is_zero), None):
        return broken(moving.t, mark("commands {v:.2f} m/s at {t:.2f} s, and nothing was asked"), v=moving.v)
    hertz = len(run.commands(0.5, until)) / (until - 0.5) if until >= 1.5 else 10.0
    if not 7.5 <= hertz <= 12.5:  # over a second, one more or one less is allowed
        return broken(until, mark("{hertz:.1f} commands a second until {t:.2f} s"), hertz=hertz)
    return None


@promise("F2", "F3")
def drives_at_the_set_speed(run: Run) -> Broken | None:
    """With nothing in the way it drives at the speed that was set, whatever was refused since."""
    return next((broken for broken, why in _off_speed(run) if why == "F2"), None)


@promise("F5")
def drives_on(run: Run) -> Broken | None:
    """When the way is free again it drives on at the set speed, and what is behind it does not matter."""
    return next((broken for broken, why in _off_speed(run) if why == "F5"), None)


@promise("F6")
def takes_no_bad_reading_for_an_obstacle(run: Run) -> Broken | None:
    """Readings that are not valid do not stop it."""
    return next((broken for broken, why in _off_speed(run) if why == "F6"), None)


@promise("F6")
def sees_what_is_real_among_bad_readings(run: Run) -> Broken | None:
    """A real obstacle among bad readings is still seen."""
    spoilt = [t for t, to in run.times("readings") if to["kind"] != "true"]
    broken = stops_in_time(run) if spoilt else None
    return broken if broken and broken.t > spoilt[0] else None


@promise("F2", "F3")
def refuses_what_is_too_fast(run: Run) -> Broken | None:
    """`set_speed` takes what is finite and within the limit, and refuses the rest with a message that states it."""
    for call in _calls(run, "set_speed"):
        speed, limit = float(call.request["speed"]), _value(run, "max_linear_speed", call.t)
        taken, message = motion.answer(call)["success"], str(motion.answer(call)["message"])
        right = math.isfinite(speed) and abs(speed) <= limit
        if taken is not right:
            words = mark("speed {speed:g} was answered success = {taken} at {t:.2f} s; the limit is {limit:g}")
            return broken(call.t, words, speed=speed, taken=taken, limit=limit)
        if not right and not check_set_speed.states(message, limit):
            words = mark("speed {speed:g} was refused at {t:.2f} s with {message!r}")
            return broken(call.t, words, speed=speed, message=message)
    return None


@promise("F7")
def status_is_true(run: Run) -> Broken | None:
    """The status has the speed in force, what is in the way, and the pose from `odom`."""
    for call in _calls(run, "get_status"):
        said = motion.answer(call)
        place, sample = said["pose"]["position"], run.sample(call.t)
        off = math.hypot(float(place["x"]) - sample.odom_x, float(place["y"]) - sample.odom_y)
        turned = abs(math.remainder(check_status.yaw(said["pose"]["orientation"]) - sample.odom_yaw, math.tau))
        if not (off <= _AGREES_M and turned <= _AGREES_RAD):
            words = mark("the pose at {t:.2f} s is {off:.2f} m and {turned:.2f} rad from that of odom")
            return broken(call.t, words, off=off, turned=turned)
        set_ = _in_force(run, call.t)
        if set_ is not None and not abs(float(said["speed"]) - set_[1]) <= 0.01:
            words = mark("speed {said:g} at {t:.2f} s, after set_speed {wanted:g}")
            return broken(call.t, words, said=float(said["speed"]), wanted=set_[1])
        blocked = _blocked(run, call.t)
        flag, status = said["obstacle_detected"], said["status"]
        if blocked is not None and (flag is not blocked or status != ("OBSTACLE_DETECTED" if blocked else "ACTIVE")):
            words = mark("obstacle_detected = {flag}, {status} at {t:.2f} s; something is in the way: {blocked}")
            return broken(call.t, words, flag=flag, status=status, blocked=blocked)
    return None


@promise("F8")
def arrives_where_it_says(run: Run) -> Broken | None:
    """A goal that succeeds has been reached, the final pose is that of odom, and the robot stands still there."""
    goals, until = _one_at_a_time(run)
    for goal in goals:
        if not goal.accepted:
            return broken(goal.t, mark("the goal at {t:.2f} s was rejected"))
        if not goal.ended_t < until:
            continue
        t = goal.ended_t
        if (goal.success is True) != (goal.status == "succeeded"):
            return broken(t, mark("the goal was {goal.status} at {t:.2f} s with success = {goal.success}"), goal=goal)
        if goal.status == "canceled" and math.isnan(goal.cancel_t):
            return broken(t, mark("the goal was canceled at {t:.2f} s without a request"))
        if goal.status != "succeeded":
            continue
        sample = run.sample(t)
        off = math.hypot(goal.x - sample.x, goal.y - sample.y)
        if not off <= goal.tolerance + _DRIFT_M:
            words = mark("the goal succeeded at {t:.2f} s, {off:.2f} m off; the tolerance is {goal.tolerance:g} m")
            return broken(t, words, off=off, goal=goal)
        off = math.hypot(goal.final_x - sample.odom_x, goal.final_y - sample.odom_y)
        if not off <= _DRIFT_M:
            return broken(t, mark("final_pose is {off:.2f} m from odom at {t:.2f} s"), off=off)
        if moving := _moves_after(run, goal, t + 1.0):
            return broken(moving.t, mark("moves at {t:.2f} s, after the goal has succeeded"))
    return None


@promise("F8")
def arrives_in_the_end(run: Run) -> Broken | None:
    """A goal with nothing in the way succeeds."""
    if run.times("obstacle"):
        return None
    goals, until = _one_at_a_time(run)
    for t, limit in run.times("arrive"):
        late = next((goal for goal in goals if goal.t < t and not goal.ended_t <= t + limit + 0.1), None)
        if late and t + limit < until:
            return broken(t + limit, mark("the goal of {a:.2f} s had not ended at {t:.2f} s"), a=late.t)
    return None


@promise("F11")
def does_not_give_up(run: Run) -> Broken | None:
    """A goal whose way is blocked goes on: it is not given up."""
    goals, until = _one_at_a_time(run)
    for goal in goals:
        if goal.accepted and goal.status == "aborted" and math.isnan(goal.cancel_t) and goal.ended_t < until:
            return broken(goal.ended_t, mark("the goal was aborted at {t:.2f} s"))
    return None


@promise("F9")
def feedback_is_true(run: Run) -> Broken | None:
    """Feedback comes twice a second, with the true distance."""
    goals, until = _one_at_a_time(run)
    for goal in (each for each in goals if each.accepted):
        wrong = next((entry for entry in goal.feedback if not abs(entry[1] - entry[2]) <= 0.15 + _DRIFT_M), None)
        if wrong and wrong[0] < until:
            return broken(wrong[0], mark("distance_remaining {w[1]:.2f} m at {t:.2f} s; it was {w[2]:.2f} m"), w=wrong)
        end = min([t for t in (goal.ended_t, goal.cancel_t) if math.isfinite(t)] + [run.end, until])
        times = [goal.t, *(entry[0] for entry in goal.feedback if entry[0] <= end), end]
        start, gap = max(((a, b - a) for a, b in itertools.pairwise(times)), key=lambda pair: pair[1])
        if gap > 0.85:  # half a second, and a tick or two at either end
            return broken(start, mark("no feedback for {gap:.1f} s from {t:.2f} s on"), gap=gap)
    return None


@promise("F10")
def cancels(run: Run) -> Broken | None:
    """A goal that is cancelled ends as canceled with success = false, and the robot stands still within 1 s."""
    goals, until = _one_at_a_time(run)
    for goal in goals:
        if not goal.accepted or math.isnan(goal.cancel_t) or goal.cancel_t + 1.1 > min(run.end, until):
            continue
        if goal.status == "succeeded" and goal.ended_t <= goal.cancel_t + 0.15:
            continue
        if goal.status != "canceled" or goal.success is not False:
            words = mark("cancelled at {t:.2f} s, the goal is {goal.status} with success = {goal.success}")
            return broken(goal.cancel_t, words, goal=goal)
        if moving := _moves_after(run, goal, goal.cancel_t + 1.0):
            words = mark("moves at {t:.2f} s, after the goal was cancelled at {c:.2f} s")
            return broken(moving.t, words, c=goal.cancel_t)
    return None


@promise("F11")
def keeps_the_limits(run: Run) -> Broken | None:
    """Speeds stay within their limits, and rise no faster than the accelerations."""
    found = check_limits.beyond(run.trial)
    return Broken(motion.time_in(found[0]), found[0]) if found else None


@promise("I8")
def ends_on_ctrl_c(run: Run) -> Broken | None:
    """Ctrl-C ends it within 2 s, without a traceback, and its last command is zero."""
    pressed = run.trial.marks.get("interrupt")
    process = run.trial.process
    if pressed is None or process is None:
        return None
    took = run.trial.measured.get("seconds_to_end")
    if took is None or took > 2.0:
        return broken(pressed, mark("still running 2 s after Ctrl-C at {t:.2f} s"))
    if BEGIN in process.output_tail and not check_interrupt.is_a_race_in_rclpy(process.output_tail):
        return broken(pressed, mark("a traceback after Ctrl-C at {t:.2f} s"))
    last = run.trial.commands[-1] if run.trial.commands else None
    if last and not last.is_zero:
        return broken(pressed, mark("the last command is {v:.2f} m/s after Ctrl-C at {t:.2f} s"), v=last.v)
    return None


# -- facts over a run --------------------------------------------------------------------------------------------------
def _one_at_a_time(run: Run) -> tuple[list[Goal], float]:
    """Return the goals up to one that comes while another is running, and the time when that comes, else inf.

    Goals are served one after another: what becomes of the two, and of those after them, the contract leaves open.
    """
    found: list[Goal] = []
    for goal in run.trial.goals:
        if any(each.accepted and not each.ended_t <= goal.t for each in found):
            return found, goal.t
        found.append(goal)
    return found, math.inf


def _calls(run: Run, service: str) -> list[Call]:
    return [call for call in run.trial.calls if call.service == service and call.response is not None]


def _in_force_at(run: Run) -> Iterator[tuple[float, Command]]:
    """Yield for each tick the command that holds then."""
    held, left = None, iter(run.trial.commands)
    following = next(left, None)
    for sample in run.trial.samples:
        while following is not None and following.t <= sample.t + 1e-9:
            held, following = following, next(left, None)
        if held is not None:
            yield sample.t, held


def _value(run: Run, name: str, t: float, within: float = 0.0) -> float:
    """Return the lowest value that a parameter had in the `within` seconds before t."""
    return min(check_limits.values_of(run.trial, name, t - within, t))


def _all_below(run: Run, t: float, where: str, limit: float) -> tuple[float, float] | None:
    """Return (t, m) of the first of the scans since 0.3 s before `t` if all read less than `limit`, else None.

    A command may answer the scan of its own tick.
    """
    scans = [(scan.t, getattr(scan, where)) for scan in run.trial.scans if t - 0.6 <= scan.t <= t + 1e-9]
    first = max((at for at, _ in scans if at <= t - _WITHIN_S), default=None)
    if first is None:
        return None
    since = [(at, read) for at, read in scans if at >= first]
    return since[0] if all(read < limit for _, read in since) else None


def _near_for(run: Run, t: float, v: float) -> tuple[float, float] | None:
    """Return (t, m) of a scan more than 0.3 s ago since which there is an obstacle in the direction of v, else None."""
    # What lies in the way is asked anew when the way is another one.
    if any(t - 0.6 <= at < t for name in ("call", "goal", "cancel") for at, _ in run.times(name)):
        return None
    if v < 0 and any(goal.t <= t and not goal.ended_t <= t for goal in run.trial.goals):
        return None
    limit = _value(run, "obstacle_detection_threshold", t, 0.6) - _NOISE
    return _all_below(run, t, "behind" if v < 0 else "ahead", limit)


def _in_force(run: Run, t: float) -> tuple[float, float] | None:
    """Return (t, m/s) of the speed in force at a time, None if the contract leaves it open."""
    if any(goal.t <= t for goal in run.trial.goals):
        return None
    set_ = [(0.0, 0.0)] + [
        (call.t, float(call.request["speed"])) for call in _calls(run, "set_speed")
        if call.t <= t and motion.answer(call)["success"] is True
    ]  # fmt: skip
    return set_[-1] if abs(set_[-1][1]) <= _value(run, "max_linear_speed", t, t) else None


def _blocked(run: Run, t: float) -> bool | None:
    """Return whether there is an obstacle in the way, None if that is a close call or has just changed."""
    set_ = _in_force(run, t)
    if run.trial.goals and not run.times("obstacle"):
        return False
    if set_ is None or any(t - 0.8 < at < t for at, _ in [*run.times("set"), set_]):
        return None
    read = [scan.behind if set_[1] < 0 else scan.ahead for scan in run.trial.scans if t - 0.45 <= scan.t <= t + 1e-9]
    limit = _value(run, "obstacle_detection_threshold", t)
    if len(read) < 3 or any(abs(each - limit) <= _NOISE for each in read):
        return None
    return None if len({each < limit for each in read}) > 1 else read[0] < limit


def _off_speed(run: Run) -> Iterator[tuple[Broken, str]]:
    """Yield where the robot should have driven at the set speed for a while and did not, and whose fault it is."""
    if not run.trial.scans:
        return
    slow = _DEFAULTS["safety_margin"] + 0.05
    for command in run.trial.commands:
        set_ = _in_force(run, command.t)
        if set_ is None or command.t > run.trial.marks.get("interrupt", math.inf):
            return
        acceleration = _value(run, "linear_acceleration", command.t, command.t)
        settled = 0.5 + abs(set_[1]) / acceleration
        start = max([set_[0], *(t for t, _ in run.times("set") if t <= command.t)])
        if command.t - start < settled:
            continue
        way = "behind" if set_[1] < 0 else "ahead"
        limit = _value(run, "obstacle_detection_threshold", command.t) + slow
        recent = [scan for scan in run.trial.scans if command.t - settled - 0.2 <= scan.t <= command.t + 1e-9]
        emergency = _value(run, "emergency_stop_distance", command.t) + _NOISE
        if any(getattr(scan, way) < limit or scan.anywhere < emergency for scan in recent):
            continue
        if abs(command.v - set_[1]) > 0.05 * abs(set_[1]) + 1e-3 or abs(command.omega) > 0.1:
            words = mark("commands {v:.3f} m/s at {t:.2f} s, with nothing in the way; set_speed was {wanted:g}")
            spoilt = any(at <= command.t and to["kind"] != "true" for at, to in run.times("readings"))
            met = any(at <= command.t for at, _ in run.times("obstacle"))
            why = "F6" if spoilt else "F5" if met else "F2"
            yield broken(command.t, words, v=command.v, wanted=set_[1]), why


def _moves_after(run: Run, goal: Goal, t: float) -> Command | None:
    """Return the first command that moves the robot after `t`, before the next request."""
    new = [at for name in ("call", "goal") for at, to in run.times(name) if to.get("service") != "get_status"]
    asked = [at for at in new if at > goal.t and at > min(goal.ended_t, t)]
    if any(at < t for at in asked):
        return None
    return next((c for c in run.commands(t, min([*asked, run.end])) if not c.is_zero), None)
