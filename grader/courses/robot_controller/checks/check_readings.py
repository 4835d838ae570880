"""F6: invalid readings."""

import math

from grader.checks.first_cause import last_output
from grader.checks.judge import Judge, NotReached
from grader.evidence import Trial
from grader.words import mark, say

from . import motion

_TRIALS = ("bad_readings", "empty_scans")


def test_bad_readings_are_not_an_obstacle(judge: Judge) -> None:
    """Readings of NaN, +inf, 0, below range_min or above range_max, and scans with no readings, are not an obstacle."""
    stopped = []
    kinds = 0
    for name in _TRIALS:
        trial = judge.trial(name, complete=False)
        speed = _speed_before(judge, trial)
        marks = sorted(trial.marks.items(), key=lambda item: item[1])
        for (kind, start), end in zip(marks, [t for _, t in marks[1:]] or [math.inf], strict=False):
            kinds += 1
            commands = motion.between(trial.commands, start + 0.1, end)
            if not commands or not min(command.v for command in commands) >= 0.9 * speed:
                stopped.append(kind)
    if stopped:
        seen = say("the robot did not drive on through scans full of: {stopped}", stopped=", ".join(stopped))
        try_ = say("count a reading only if it is finite and range_min <= reading <= range_max")
        if stopped == ["no readings"]:
            try_ = say("a scan with no readings is data, too: nothing is in the way")
        judge.share(1 - len(stopped) / max(kinds, 7), seen, try_)


def test_bad_readings_do_not_crash_the_node(judge: Judge) -> None:
    """Bad readings, and a scan with no readings, do not crash the node."""
    crashes = []
    for name in (*_TRIALS, "obstacle_among_bad_readings"):
        trial = judge.trial(name, complete=False)
        if trial.ended and not trial.marks:
            raise judge.not_reached(trial.ended, trial)
        if trial.ended:
            phase = max(trial.marks.items(), key=lambda item: item[1])[0]
            words = mark("after {phase}: {trial.ended}{last_output}")
            crashes.append(say(words, phase=phase, trial=trial, last_output=last_output(trial)))
    _expect_scans(judge)
    judge.expect(not crashes, "; ".join(crashes), motion.TRY_MIN)


def test_a_real_obstacle_among_bad_readings_is_seen(judge: Judge) -> None:
    """A real obstacle among bad readings is still seen."""
    trial = judge.trial("obstacle_among_bad_readings")
    _speed_before(judge, trial)
    since = trial.marks["obstacle"]
    zero = next((c.t for c in trial.commands if c.t > since and c.is_zero), math.inf)
    words = mark("no zero came within 1 s of an obstacle 0.45 m ahead, seen by one beam in four among bad readings")
    judge.expect(zero - since <= 1.0, say(words), say("what does min() return for a list that starts with NaN?"))
    free, true = trial.marks["nothing in range"], trial.marks["true scans"]
    if not _drives(trial, free + 0.8, true) and _drives(trial, true + 0.2, trial.marks["at range_min"]):
        seen = say("the obstacle was gone and all beams read +inf: the robot stood still until some read less again")
        judge.share(0.5, seen, say("where no reading is valid, nothing is in the way: forget the earlier scan"))
    edge = trial.marks["at range_min"]
    before = [c for c in trial.commands if c.t <= edge]
    if before[-1].v > 0.05 and not any(c.is_zero for c in motion.between(trial.commands, edge, math.inf)):
        seen = say("the robot drove on through scans that read 0.25 m, exactly their range_min")
        judge.share(0.5, seen, motion.TRY_LIMITS)


def _expect_scans(judge: Judge) -> None:
    """Raise NotReached if no reading comes to the robot: its node does not subscribe, and nothing lets it stop."""
    trial = judge.trial("obstacle_among_bad_readings", complete=False)
    graph, came = trial.graph, trial.marks.get("obstacle", math.inf)
    subscribed = graph is None or any(e.topic == "scan" and e.kind == "subscription" for e in graph.endpoints)
    stops = _drives(trial, 0.0, came) and any(c.t > came and c.is_zero for c in trial.commands)
    if not (subscribed or stops):
        raise NotReached(say("the node does not subscribe to scan, so no bad reading came to it"), "I4")


def _drives(trial: Trial, start: float, end: float) -> bool:
    return any(command.v > 0.05 for command in motion.between(trial.commands, start, end))


def _speed_before(judge: Judge, trial: Trial) -> float:
    """Return the speed commanded before the first bad scan, in m/s; F2 judges whether it is the set one."""
    judge.call(trial, "set_speed", 0)
    _expect_scans(judge)
    before = min(trial.marks.values(), default=math.inf)
    last = next((c for c in reversed(trial.commands) if c.t <= before), None)
    if last is None or not last.v > 0.05:
        raise NotReached(say("the robot did not drive before the bad readings came"), "F2")
    return last.v
