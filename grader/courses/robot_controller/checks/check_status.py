"""F7: the get_status service."""

import math
from typing import Any

from grader.checks.judge import Judge, NotReached
from grader.evidence import Call, Trial
from grader.words import mark, say

from . import motion

_MOMENTS = (
    mark("standing"),
    mark("driving"),
    mark("before an obstacle 0.45 m ahead"),
    mark("when the obstacle is gone"),
)
_FLAG = mark("obstacle_detected = {flag} {moment}")
_OBSTACLES = (False, False, True, False)
_LATER = range(len(_MOMENTS), len(_MOMENTS) + 3)  # beside a pole, then backwards with an obstacle ahead and behind
_SPEED = mark("speed {speed:g} while {moment}, after set_speed {wanted:g}")
_AGREES_M, _AGREES_RAD = 0.1, 0.2  # the pose may be a message old


def test_status_gives_the_speed_in_force(judge: Judge) -> None:
    """`get_status` reports the speed in force."""
    trial, calls = _calls(judge)
    judge.call(trial, "set_speed", 0)
    if abs(motion.odometry_speed(trial.samples, calls[1].t - 0.4, calls[1].t)) < 0.02:
        raise NotReached(say("the robot stood still after set_speed, so no speed was in force"), "F2")
    for moment, call, wanted in zip(map(say, _MOMENTS), calls, (0.0, trial.choices["speed"]), strict=False):
        speed = float(motion.answer(call)["speed"])
        seen = say(_SPEED, speed=speed, moment=moment, wanted=wanted)
        judge.expect(abs(speed - wanted) <= 0.01, seen, say("answer with the speed that set_speed put in force"))
    backwards = judge.trial("wall_backward", complete=False)
    asked = next((call for call in backwards.calls if call.service == "get_status" and call.response), None)
    put = next((call for call in backwards.calls if call.service == "set_speed" and call.response), None)
    if asked is not None and put is not None and motion.answer(put)["success"] is True:
        speed, wanted = float(motion.answer(asked)["speed"]), float(put.request["speed"])
        if abs(speed - wanted) > 0.01:
            seen = say(_SPEED, speed=speed, moment=say("driving backwards"), wanted=wanted)
            judge.share(0.5, seen, say("report the speed with its sign"))
    if died := motion.died_after(3, judge, judge.trial("navigate_again", complete=False)):
        judge.share(0.5, say("get_status after a goal: {died}", died=died), motion.TRY_TYPES)


def test_status_reports_an_obstacle(judge: Judge) -> None:
    """`get_status` reports whether there is an obstacle."""
    trial, calls = _calls(judge)
    for moment, call, wanted in zip(map(say, _MOMENTS), calls, _OBSTACLES, strict=True):
        flag = motion.answer(call)["obstacle_detected"]
        seen = say(_FLAG, flag=flag, moment=moment)
        judge.expect(flag is wanted, seen, say("set the flag from every scan, to True or to False"))
    answers = [motion.answer(judge.call(trial, "get_status", index)) for index in _LATER]
    aside, ahead, behind = (answer["obstacle_detected"] for answer in answers)
    later = [(aside, False, mark("while driving past a pole 0.4 m away, more than 60 degrees to one side"))]
    since = trial.marks["backwards"]
    if motion.odometry_speed(trial.samples, since - 0.2, since) < -0.05:  # F2 judges whether it drives backwards
        later.append((ahead, False, mark("while driving backwards, away from an obstacle")))
        later.append((behind, True, mark("after driving backwards, with an obstacle 0.45 m behind")))
    wrong = [say(_FLAG, flag=flag, moment=say(moment)) for flag, wanted, moment in later if flag is not wanted]
    if wrong and not (behind is True and _stops_for_what_is_behind(judge)):
        judge.share(0.5, "\n".join(wrong), motion.TRY_SECTOR)


def test_status_gives_the_pose_from_odometry(judge: Judge) -> None:
    """`get_status` reports the pose from `odom`."""
    trial, calls = _calls(judge)
    for moment, call in zip(map(say, _MOMENTS), calls, strict=True):
        position, turned_to = motion.answer(call)["pose"]["position"], yaw(motion.answer(call)["pose"]["orientation"])
        sample = motion.at(trial.samples, call.t)
        off = max(abs(float(position["x"]) - sample.odom_x), abs(float(position["y"]) - sample.odom_y))
        turned = abs(math.remainder(turned_to - sample.odom_yaw, math.tau))
        words = mark("the pose {moment} is {off:.2f} m and {turned:.2f} rad from that of odom")
        seen = say(words, moment=moment, off=off, turned=turned)
        agrees = off <= _AGREES_M and turned <= _AGREES_RAD
        judge.expect(agrees, seen, say("keep the pose of the latest odometry message and answer with all of it"))


def test_status_is_active_or_obstacle_detected(judge: Judge) -> None:
    """The status is `ACTIVE`, or `OBSTACLE_DETECTED` while there is an obstacle."""
    _, calls = _calls(judge)
    for moment, call, obstacle in zip(map(say, _MOMENTS), calls, _OBSTACLES, strict=True):
        status, wanted = motion.answer(call)["status"], "OBSTACLE_DETECTED" if obstacle else "ACTIVE"
        seen = say("status {status!r} {moment}", status=status, moment=moment)
        judge.expect(status == wanted, seen, say("the status should be {wanted} here", wanted=wanted))
    asked = motion.on_the_way(judge.trial("navigate_again", complete=False), "get_status")
    if asked is not None and asked.response is None:
        seen = say("{asked.problem} on the way to a goal", asked=asked)
        judge.share(0.5, seen, say("do not let a callback wait for the end of a goal"))
    elif asked is not None and motion.answer(asked)["status"] != "ACTIVE":
        seen = say("status {status!r} on the way to a goal", status=motion.answer(asked)["status"])
        judge.share(0.5, seen, say("the status during a goal is ACTIVE, too"))


def _stops_for_what_is_behind(judge: Judge) -> bool:
    """Return whether the robot also stops for obstacles behind it, which F5 judges."""
    trial = judge.trial("obstacle_behind", complete=False)
    marks = trial.marks
    return "end" not in marks or motion.odometry_speed(trial.samples, marks["start"], marks["end"]) < 0.15


def yaw(q: dict[str, Any]) -> float:
    """Return the yaw of a quaternion as it stands in an answer, in rad."""
    x, y, z, w = (float(q[axis]) for axis in "xyzw")
    return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def _calls(judge: Judge) -> tuple[Trial, list[Call]]:
    trial = judge.trial("status")
    return trial, [judge.call(trial, "get_status", index) for index in range(len(_MOMENTS))]
