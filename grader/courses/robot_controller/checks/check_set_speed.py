"""F2 and F3: the set_speed service."""

import math
import re
from collections.abc import Callable

from grader.checks.judge import Judge, NotReached
from grader.evidence import Call, Trial
from grader.words import mark, say

from . import motion

_MOVED_M = 0.1
_MOVING_MPS = 0.02  # half of the lowest speed that the trials ask for would be 0.06


def test_accepts_a_speed_within_the_limit(judge: Judge) -> None:
    """`set_speed` with abs(speed) <= `max_linear_speed` answers success with a message."""
    for name in ("drive_forward", "drive_backward"):
        trial = judge.trial(name)
        for index in range(sum(call.service == "set_speed" for call in trial.calls)):
            call = judge.call(trial, "set_speed", index)
            answer = motion.answer(call)
            words = mark("speed {asked:g} answered success = {answer[success]}, message {answer[message]!r}")
            seen = say(words, asked=_asked(call), answer=answer)
            try_ = say("compare abs(speed) with the limit; the limit itself is allowed")
            judge.expect(answer["success"] is True, seen, try_)
            judge.expect(bool(str(answer["message"]).strip()), seen, say("fill response.message too"))
    trials = [judge.trial(name) for name in ("drive_forward", "drive_backward")]
    seen = say("success = True was answered to every speed, and the robot never moved")
    moved = any(motion.reach(trial.samples, 0.0, math.inf) >= _MOVED_M for trial in trials)
    judge.expect(moved, seen, say("put the accepted speed into cmd_vel"))


def test_drives_at_the_set_speed(judge: Judge) -> None:
    """After an accepted `set_speed` the robot drives at that speed (odometry within 5 %)."""
    trial = judge.trial("drive_forward")
    judge.call(trial, "set_speed", 0)
    _expect_speed(judge, trial, trial.choices["speed"], "cruise", "cruise_end")
    _expect_the_limit(judge, trial)


def test_drives_backwards_at_a_negative_speed(judge: Judge) -> None:
    """A negative speed drives the robot backwards, at that speed (odometry within 5 %)."""
    trial = judge.trial("drive_backward")
    judge.call(trial, "set_speed", 0)
    _expect_speed(judge, trial, -trial.choices["speed"], "cruise", "cruise_end")
    _expect_the_limit(judge, trial)
    stopped = motion.answer(judge.call(trial, "set_speed", 2))
    if stopped["success"] is True and not motion.stays_still(trial.samples, trial.marks["stopped"]):
        seen = say("v = {v:.2f} m/s 1.5 s after set_speed 0 was accepted", v=trial.samples[-1].v)
        judge.share(0.5, seen, say("0 is a speed like any other, not a sign that none was given"))


def test_refuses_a_speed_above_the_limit(judge: Judge) -> None:
    """`set_speed` above the limit, forwards or backwards, answers success = false."""
    try_ = say("compare abs(speed) with the limit")
    _expect_refused(judge, lambda speed: math.isfinite(speed) and abs(speed) > 0.5, try_)
    wrong = []
    call = motion.on_the_way(judge.trial("navigate_again", complete=False), "set_speed")
    if call is not None and not _was_refused(call):
        wrong.append(say("speed {asked:g} was not refused on the way to a goal", asked=_asked(call)))
    changed = judge.trial("changed_limits", complete=False)
    lowered = any(p.name == "max_linear_speed" and p.accepted is True for p in changed.parameters)
    call = next((c for c in changed.calls if c.request.get("speed") == 0.375), None)
    if lowered and call is not None and not _was_refused(call):
        wrong.append(say("speed 0.375 was not refused after max_linear_speed was set to 0.25"))
    if wrong:
        try_ = say("the limit is the parameter's value at the time of the call, during a goal, too")
        judge.share(1 - 0.5 * len(wrong), "; ".join(wrong), try_)


def test_refuses_a_speed_that_is_not_finite(judge: Judge) -> None:
    """`set_speed` with NaN or infinity answers success = false."""
    try_ = say("NaN compares False with everything: use math.isfinite")
    _expect_refused(judge, lambda speed: not math.isfinite(speed), try_)


def test_a_refusal_states_the_limit(judge: Judge) -> None:
    """A refusal's message states the limit."""
    words = mark("with max_linear_speed {limit}, speed {asked:g} was refused with the message {message!r}")
    for call in _refusals(judge):
        message = str(motion.answer(call)["message"])
        if motion.answer(call)["success"] is False:
            seen = say(words, limit=0.5, asked=_asked(call), message=message)
            stated = "0.5" in message or "0,5" in message
            judge.expect(stated, seen, say("say in the message which limit holds, in m/s"))
    # I6 judges whether another limit takes effect; where it does, it is the one to state.
    slow = [call for call in judge.started("slow_robot").calls if call.service == "set_speed" and call.response]
    message = str(motion.answer(slow[0]).get("message")) if slow else ""
    if slow and motion.answer(slow[0]).get("success") is False and not states(message, 0.25):
        seen = say(words, limit=0.25, asked=_asked(slow[0]), message=message)
        judge.share(0.5, seen, say("put the parameter's value into the message, not a fixed number"))


def test_a_refusal_leaves_the_speed_in_force(judge: Judge) -> None:
    """After a refusal the speed in force stays as it was."""
    calls = _refusals(judge)
    trial = judge.trial("refuse_speed")
    accepted = [_asked(call) for call in calls if motion.answer(call).get("success") is not False]
    seen = say("the speeds {accepted} were not refused", accepted=accepted)
    judge.expect(not accepted, seen, say("refuse them first; then this can be judged"))
    start, end = trial.marks["refusals"], trial.marks["refusals_end"]
    # F2 judges whether it drove at the set speed before.
    before = motion.odometry_speed(trial.samples, start - 0.4, start)
    after = motion.odometry_speed(trial.samples, end - 0.5, end)
    seen = say("{before:.3f} m/s before the refusals, {after:.3f} m/s after them", before=before, after=after)
    if abs(before) < _MOVING_MPS:
        raise NotReached(say("the robot did not drive at the speed that was set before the refusals"), "F2")
    holds = abs(after - before) <= 0.05 * max(abs(before), 0.1)
    judge.expect(holds, seen, say("change the speed in force only after every test of the request has passed"))


def states(message: str, limit: float) -> bool:
    """Return whether a message contains `limit`, rounded to one decimal place or more."""
    numbers = [float(number.replace(",", ".")) for number in re.findall(r"\d+(?:[.,]\d+)?|[.,]\d+", message)]
    return any(abs(number - limit) <= 0.05 + 1e-9 for number in numbers)


def _expect_the_limit(judge: Judge, trial: Trial) -> None:
    """Expect the robot to drive at the limit itself, if that was accepted; another check judges whether it was."""
    if motion.answer(judge.call(trial, "set_speed", 1)).get("success") is not False:
        _expect_speed(judge, trial, trial.choices["limit"], "at_limit", "at_limit_end")


def _expect_speed(judge: Judge, trial: Trial, wanted: float, start: str, end: str) -> None:
    speed = motion.odometry_speed(trial.samples, trial.marks[start], trial.marks[end])
    words = mark("{speed:.3f} m/s by odometry from {a:.1f} to {b:.1f} s, after set_speed {wanted:g}")
    seen = say(words, speed=speed, a=trial.marks[start], b=trial.marks[end], wanted=wanted)
    holds = abs(speed - wanted) <= 0.05 * abs(wanted)
    judge.expect(holds, seen, say("does every control cycle publish the set speed, in m/s?"))


def _expect_refused(judge: Judge, which: Callable[[float], bool], try_: str) -> None:
    for call in _refusals(judge):
        if which(_asked(call)):
            answer = motion.answer(call)
            seen = say("speed {asked:g} answered success = {answer[success]}", asked=_asked(call), answer=answer)
            judge.expect(answer["success"] is False, seen, try_)


def _refusals(judge: Judge) -> list[Call]:
    """Return the calls with invalid speeds, all answered; the first call of the trial is the valid one.

    A node that refuses every speed has not shown that it tells them apart.
    """
    trial = judge.trial("refuse_speed")
    first = judge.call(trial, "set_speed", 0)
    if motion.answer(first)["success"] is False:
        raise NotReached(say("speed {asked:g}, within the limit, was refused as well", asked=_asked(first)), "F2")
    count = sum(call.service == "set_speed" for call in trial.calls)
    return [judge.call(trial, "set_speed", index) for index in range(1, count)]


def _was_refused(call: Call) -> bool:
    """Return whether a call was refused; one without an answer is judged elsewhere."""
    return call.response is None or call.response["success"] is False


def _asked(call: Call) -> float:
    return float(call.request["speed"])
