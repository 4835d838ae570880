"""Cases for the sensor processor, and what it promises in each of them."""

from __future__ import annotations

import itertools

from hypothesis import strategies as st
from hypothesis.strategies import SearchStrategy

from grader.checks.judge import Failed
from grader.courses.robot_controller.checks import check_fusion, motion
from grader.courses.robot_controller.hunts.controller_cases import named
from grader.evidence import Message
from grader.trials.case import Case, Step
from grader.trials.promises import Broken, Run, broken, makes, promise
from grader.words import mark

NODE, _FUSED, _DISTANCE = "sensor_processor", "sensor_fusion_data", "obstacle_distance"
_RATE = 20.0
_SILENT_S = 0.5  # of ten messages; another promise counts them
_WARN, _ERROR = 30, 40
_LOW, _CRITICAL = "battery_low_threshold", "battery_critical_threshold"
_DEFAULTS = motion.COURSE.nodes[NODE].defaults

_wait = st.integers(2, 12).map(lambda n: Step("wait", n / 10))
_SENSORS = ("scan", "imu", "battery")
_sensor = st.sampled_from(_SENSORS)


@makes("F12", "F13")
def _fuses() -> SearchStrategy[Case]:
    """Sensors that begin, end and begin again, obstacles all around, bad readings, any battery."""
    distance = st.integers(13, 75).map(lambda n: n / 50)
    place = st.fixed_dictionaries({"bearing": st.integers(-180, 180), "distance": distance})
    kind = st.sampled_from(["nan", "zero", "too near", "too far", "inf", "none", "true"])
    spoilt = st.fixed_dictionaries({"kind": kind, "every": st.sampled_from([1, 2, 7])})
    hear = st.builds(Step, st.just("hear"), _sensor)
    step = st.one_of(
        hear, hear, st.builds(Step, st.just("silence"), _sensor),
        place.map(lambda to: Step("obstacle", {"name": "pole", **to, "radius": 0.15})),
        st.builds(Step, st.just("battery"), st.integers(3, 100)), st.builds(Step, st.just("readings"), spoilt),
    )  # fmt: skip
    first = [Step("listen", _FUSED), Step("listen", _DISTANCE), *(Step("silence", each) for each in _SENSORS)]
    first += [Step("wait", 0.4), Step("hear", "scan"), Step("wait", 0.6)]
    pairs = st.lists(st.tuples(step, _wait), min_size=2, max_size=7)
    return pairs.map(lambda found: Case(NODE, named([*first, *itertools.chain(*found)])))


@makes("F12")
def _drains() -> SearchStrategy[Case]:
    """A battery that runs down, with other thresholds or the default ones."""
    thresholds = st.sampled_from([{}, {_LOW: 30.0, _CRITICAL: 15.0}, {_LOW: 55.0, _CRITICAL: 5.0}])
    levels = st.lists(st.integers(2, 95), min_size=2, max_size=5).map(lambda found: sorted(set(found), reverse=True))
    return st.builds(_draining, thresholds, levels)


def _draining(parameters: dict[str, float], levels: list[int]) -> Case:
    steps = itertools.chain(*([Step("battery", level), Step("wait", 1.1)] for level in levels))
    return Case(NODE, (Step("listen", "rosout"), *steps), parameters=parameters)


def _messages(run: Run, topic: str) -> list[Message]:
    return [message for message in run.trial.messages if message.topic == topic]


def _by_wall(run: Run) -> bool:
    """Return whether the node went by the wall clock: until that was seen, the simulated one ran ahead of it."""
    return run.trial.pace == "real time"


def _followed(run: Run, field: str) -> Broken | None:
    try:
        check_fusion.expect_followed(run.trial, _messages(run, _FUSED), field, "")
    except Failed as failed:
        return Broken(min(motion.time_in(failed.seen), run.end), failed.seen)
    return None


@promise("F12")
def fuses_the_closest_valid_reading(run: Run) -> Broken | None:
    """`closest_obstacle_distance` is the closest valid reading of the latest scan, inf where there is none."""
    return _followed(run, "closest_obstacle_distance")


@promise("F12")
def fuses_whatever_is_read(run: Run) -> Broken | None:
    """From the first scan on fused data come, whether or not one of its readings is valid."""
    if not run.trial.scans or _by_wall(run) or not any(to == _FUSED for _, to in run.times("listen")):
        return None
    times = [run.trial.scans[0].t, *(m.t for m in _messages(run, _FUSED)), run.end]
    for before, after in itertools.pairwise(times):
        if after - before > _SILENT_S:
            return broken(after, mark("no fused data from {since:.2f} to {t:.2f} s"), since=before)
    return None


@promise("F12")
def fuses_the_latest_imu(run: Run) -> Broken | None:
    """Acceleration and angular velocity are those of the latest IMU message, zero before the first."""
    return _followed(run, "linear_acceleration") or _followed(run, "angular_velocity")


@promise("F12")
def fuses_the_battery_in_percent(run: Run) -> Broken | None:
    """`battery_level` is in percent, 100 before the first battery message."""
    return _followed(run, "battery_level")


@promise("F12")
def says_once_that_the_battery_is_low(run: Run) -> Broken | None:
    """A battery below the low threshold is logged as a warning once, below the critical one as an error once."""
    if not any(to == "rosout" for _, to in run.times("listen")):
        return None
    levels = [(m.t, 100.0 * m.data["percentage"]) for m in run.trial.published if m.topic == "battery/state"]
    low, critical = (float({**_DEFAULTS, **run.case.parameters}[name]) for name in (_LOW, _CRITICAL))
    for level, word, below, needed in (
        (_WARN, "warning", low, any(critical <= percent < low for _, percent in levels)),
        (_ERROR, "error", critical, any(percent < critical for _, percent in levels)),
    ):
        found = check_fusion.battery_logs(run.trial.messages, level)
        crossed = next((t for t, percent in levels if percent < below), run.end)
        if len(found) > 1 or any(m.t < crossed - 1e-9 for m in found):
            words = mark("{n} times a battery {word} by {t:.2f} s; below {below:g} % it was at {crossed:.2f} s")
            return broken(found[-1].t, words, n=len(found), word=word, below=below, crossed=crossed)
        if needed and not found and run.end > crossed + 1.0:
            words = mark("no battery {word}, though it was below {below:g} % at {t:.2f} s")
            return broken(crossed, words, word=word, below=below)
    return None


@promise("F13")
def publishes_in_time(run: Run) -> Broken | None:
    """Nothing is published before the first scan; from then on both topics come at the fusion frequency."""
    if not run.trial.scans:
        return None
    first = run.trial.scans[0].t
    for topic in [to for _, to in run.times("listen") if to in (_FUSED, _DISTANCE)]:
        found = _messages(run, topic)
        if found and found[0].t < first - 1e-9:
            return broken(found[0].t, mark("{topic} at {t:.2f} s, before the first scan"), topic=topic)
        seconds = run.end - first - 0.4
        judged = seconds >= 1.0 and not _by_wall(run)
        hertz = sum(m.t > first + 0.4 for m in found) / seconds if judged else _RATE
        if not 0.8 * _RATE - 1.0 <= hertz <= 1.2 * _RATE + 1.0:
            return broken(run.end, mark("{topic} at {hertz:.1f} Hz until {t:.2f} s"), topic=topic, hertz=hertz)
    for message in _messages(run, _FUSED):
        stamp, frame = motion.stamp(message), message.data["header"]["frame_id"]
        if not abs(stamp - message.t) <= check_fusion.LATE_S[run.trial.pace] + 1e-6 or frame != "base_link":
            words = mark("a stamp of {stamp:.2f} s in {frame!r} at {t:.2f} s")
            return broken(message.t, words, stamp=stamp, frame=frame)
    return None
