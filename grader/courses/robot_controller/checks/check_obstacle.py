"""F4 and F5: stopping before an obstacle, and driving on when none is in the way."""

import math
from dataclasses import replace
from typing import Any

from grader.checks.judge import Failed, Judge, NotReached
from grader.evidence import Trial
from grader.words import mark, say

from . import motion

_TRIALS = ("wall_fast", "wall_slow", "wall_backward", "pole_aside", "creeping")
_SUDDEN = "obstacle_vanishes"
_EMERGENCY_M = motion.DEFAULTS["emergency_stop_distance"]
_SLACK_S = 0.05  # one tick of the trial: the time of a command is known no better than that


def test_never_touches_the_obstacle(judge: Judge) -> None:
    """Driven at an obstacle at any allowed speed, the robot stops and never touches it."""
    for trial in _driven(judge):
        if trial.touches:
            touch = trial.touches[0]
            seen = say("touched the {touch.obstacle} at {touch.t:.2f} s, moving at {touch.speed:.2f} m/s", touch=touch)
            raise Failed(seen, say("which readings look ahead, and what happens when one of them is near?"))
        last, left = trial.samples[-1], motion.closest_ahead(trial)
        seen = say("still moving {left:.2f} m before the obstacle when the trial ended", left=left)
        # F2 judges how long it takes to get there.
        still = motion.first_near(trial) > last.t - 1.5 or motion.stays_still(trial.samples, last.t - 1.0)
        judge.expect(still, seen + _where(trial), say("publish zero as long as there is an obstacle"))


def test_stops_within_three_tenths_of_a_second(judge: Judge) -> None:
    """`cmd_vel` is zero within 0.3 s of the first scan whose closest valid reading is below the threshold."""
    for trial in [*_driven(judge), judge.trial(_SUDDEN)]:
        near = motion.first_near(trial)
        if math.isinf(near):
            continue  # it stopped before it had to
        zero = next((c.t for c in trial.commands if c.t >= near - 1e-9 and c.is_zero), math.inf)
        words = mark("after the first scan below {limit} m at {near:.2f} s a zero came at {zero:.2f} s{where}")
        if math.isinf(zero):
            words = mark("after the first scan below {limit} m at {near:.2f} s no zero came{where}")
        seen = say(words, limit=motion.THRESHOLD_M, near=near, zero=zero, where=_where(trial))
        nearest = min((distance for t, distance in motion.in_the_way(trial) if t <= zero), default=math.inf)
        seen += say("; the closest reading was {nearest:.2f} m by then", nearest=nearest)
        try_ = say("stop in the cycle that sees the scan, without averaging or waiting")
        judge.expect(zero - near <= 0.3 + _SLACK_S, seen, try_)


def test_commands_zero_in_an_emergency(judge: Judge) -> None:
    """With a valid reading below `emergency_stop_distance` in any direction `cmd_vel` is zero for everything."""
    trial = judge.trial("emergency", complete=False)  # what a goal does to the node is not judged here
    judge.call(trial, "set_speed", 0)
    marks = {where: trial.marks.get(where, -math.inf) for where in ("beside", "behind")}
    before = {where: motion.between(trial.commands, t - 0.3, t) for where, t in marks.items()}
    moved = [where for where, commands in before.items() if not all(command.is_zero for command in commands)]
    if not moved and trial.ended:
        raise judge.not_reached(trial.ended, trial)
    if not moved:
        raise NotReached(say("the robot neither drove nor turned before something came near"), "F2", "F8")
    for where in moved:
        near = next((s.t for s in trial.scans if s.t >= trial.marks[where] and s.anywhere < _EMERGENCY_M), math.inf)
        left = next((s.t for s in trial.scans if s.t > near and s.anywhere >= _EMERGENCY_M), math.inf)
        end = min(left, trial.marks.get(f"{where}, gone", math.inf))
        late = [c for c in motion.between(trial.commands, near + 0.3 + _SLACK_S, end) if not c.is_zero]
        if late:
            words = mark(
                "commanded {c.v:.2f} m/s and {c.omega:.2f} rad/s {delay:.2f} s after the first scan below {limit} m, "
                "with something {where} the robot"
            )
            side = say("beside") if where == "beside" else say("behind")
            seen = say(words, c=late[0], delay=late[0].t - near, limit=_EMERGENCY_M, where=side)
            raise Failed(seen, say("nearer than `emergency_stop_distance` nothing is allowed, no turning either"))
    if "behind" not in moved:
        judge.remark(say("it turned towards no goal, so only driving was looked at"))


def test_drives_on_when_the_obstacle_goes_away(judge: Judge) -> None:
    """When the obstacle goes away the robot drives on at the set speed."""
    trial = judge.trial("obstacle_vanishes")
    judge.call(trial, "set_speed", 0)
    marks, wanted = trial.marks, trial.choices["speed"]
    before = motion.odometry_speed(trial.samples, marks["blocked"] - 0.5, marks["blocked"])
    if before < 0.05:
        raise NotReached(say("the robot did not drive before the obstacle came"), "F2")
    stood = motion.odometry_speed(trial.samples, marks["blocked"] + 1.0, marks["free"])
    if abs(stood) > 0.05:
        raise NotReached(say("the robot did not stop for the obstacle: it drove at {stood:.2f} m/s", stood=stood), "F4")
    speed = motion.odometry_speed(trial.samples, marks["cruise"], marks["cruise_end"])
    words = mark("after set_speed {wanted:g}: {before:.3f} m/s before the obstacle, {speed:.3f} m/s after it was gone")
    seen = say(words, before=before, speed=speed, wanted=wanted)
    # F2 judges whether it drove at the set speed before.
    within = 0.05 * max(before, 0.1)
    judge.expect(
        abs(speed - before) <= within, seen, say("where is the obstacle flag cleared, and where is the set speed kept?")
    )
    again = motion.odometry_speed(trial.samples, marks["again"], marks["again_end"])
    if abs(again - before) > within:
        seen = say("{seen}, but {again:.3f} m/s after it had slowed down for a later one", seen=seen, again=again)
        judge.share(0.5, seen, say("keep the set speed apart from the speed that is commanded at the moment"))


def test_drives_forward_with_an_obstacle_behind(judge: Judge) -> None:
    """An obstacle behind the robot does not stop it from driving forward."""
    trial = judge.trial("obstacle_behind")
    judge.call(trial, "set_speed", 0)
    way = abs(motion.odometry_speed(trial.samples, trial.marks["start"], trial.marks["end"])) * 2.0
    words = mark("drove {way:.2f} m in 2 s at set_speed 0.25 with something {distance:g} m behind")
    judge.expect(way >= 0.3, say(words, way=way, distance=trial.choices["distance"]), motion.TRY_SECTOR)


def _where(trial: Trial) -> str:
    words = mark("; the obstacle was {degrees:.0f} degrees to one side, and up to 60 count as ahead")
    return say(words, degrees=trial.choices["degrees"]) if "degrees" in trial.choices else ""


def _driven(judge: Judge) -> list[Trial]:
    """Return the trials in which the robot came near the obstacle: a robot that never drove has avoided nothing."""
    trials = []
    for name in _TRIALS:
        trial = judge.trial(name)
        if motion.answer(judge.call(trial, "set_speed", 0)).get("success") is False and name == "wall_fast":
            continue  # it refuses the limit itself; F2 judges that
        nearest = motion.closest_ahead(trial)
        if nearest <= 1.0 or trial.touches:
            trials += _each_obstacle(trial)
        elif trial.choices["speed"] > 0:
            words = mark("the robot never came near the obstacle: {nearest:.2f} m at best")
            raise NotReached(say(words, nearest=nearest), "F2")
    return trials


def _each_obstacle(trial: Trial) -> list[Trial]:
    """Return a trial with two obstacles, one after the other, as a trial for each."""
    if "other side" not in trial.marks:
        return [trial]
    ends = ((0.0, trial.marks["free"]), (trial.marks["other side"], math.inf))
    return [_part(trial, start, end) for start, end in ends]


def _part(trial: Trial, start: float, end: float) -> Trial:
    lists: dict[str, Any] = {
        name: [each for each in getattr(trial, name) if start <= each.t <= end]
        for name in ("scans", "samples", "commands", "touches")
    }
    return replace(trial, **lists)
