"""F12 and F13: what the sensor processor publishes, and when."""

import itertools
import math
from typing import Any

from grader.checks.first_cause import last_output
from grader.checks.judge import Failed, Judge, NotReached
from grader.checks.wording import near_topic
from grader.evidence import Message, Trial
from grader.words import mark, say

from . import motion

_TICK_S = 0.05
# How late a message may be. In lockstep it answers its tick; in real time a busy machine delays it: by three ticks,
# as measured.
LATE_S = {"lockstep": 2 * _TICK_S, "real time": 6 * _TICK_S}
_DISTANCE = "closest_obstacle_distance"
_SOURCES = {
    _DISTANCE: ("raw_scan", 0.01),
    "battery_level": ("battery/state", 0.1),
    "linear_acceleration": ("imu/data", 1e-6),
    "angular_velocity": ("imu/data", 1e-6),
}
"""The topic that a field of fused data comes from, and by how much it may be off."""
_BATTERY_S = 1.0  # between battery messages: an alarm may wait for the next one
_SLOWEST_HZ, _FASTEST_HZ = 16.0, 24.0
_TRY_RATE = mark("publish both from one timer with the period 1 / fusion_frequency")
_WARN, _ERROR = 30, 40  # rcl_interfaces/msg/Log


def test_fuses_the_closest_valid_reading(judge: Judge) -> None:
    """`closest_obstacle_distance` is the closest valid reading, inf where there is none."""
    try_ = say(
        "of all beams, not only those ahead, leave out readings that are not finite or outside [range_min, range_max]; "
        "inf when none is left"
    )
    trial, fused = _fused(judge)
    edge = trial.marks.get("at range_min", math.inf)
    expect_followed(trial, [message for message in fused if message.t < edge], _DISTANCE, try_)
    expect_followed(*_fused_without_readings(judge), _DISTANCE, try_)
    try:
        expect_followed(trial, [message for message in fused if message.t >= edge], _DISTANCE, try_)
    except Failed as failed:
        seen = say("{failed.seen}, which is range_min itself", failed=failed)
        judge.share(0.5, seen, motion.TRY_LIMITS)


def test_fuses_the_battery_in_percent(judge: Judge) -> None:
    """`battery_level` is in percent, 0 to 100; 100.0 before the first battery message."""
    try_ = say("BatteryState.percentage is 0 to 1; start with 100.0, and do not round")
    expect_followed(*_fused(judge), "battery_level", try_)


def test_fuses_the_latest_imu_message(judge: Judge) -> None:
    """Acceleration and angular velocity are those of the latest IMU message, zero before the first."""
    for field in ("linear_acceleration", "angular_velocity"):
        expect_followed(*_fused(judge), field, say("keep the latest Imu message and copy both vectors from it"))


def test_battery_alarms_are_logged_once(judge: Judge) -> None:
    """Battery below the low threshold is logged as a warning once, below the critical threshold as an error once."""
    trial = judge.trial("battery_runs_down")
    levels = [(m.t, 100.0 * m.data["percentage"]) for m in trial.published if m.topic == "battery/state"]
    for level, word, threshold in ((_ERROR, "error", 15), (_WARN, "warning", 30)):
        found = battery_logs(trial.messages, level)
        crossed = next(t for t, percent in levels if percent < threshold)
        words = mark("{n} times get_logger().{word}(...), where the battery fell below {percent} % at {t:.1f} s")
        seen = say(words, n=len(found), word=word, percent=threshold, t=crossed)
        latest = crossed + _BATTERY_S + LATE_S[trial.pace]
        then = [m for m in _own_logs(trial.messages) if crossed - 1e-9 <= m.t <= latest]
        if then and not found:
            seen += say("; then it logged {then[0].data[msg]!r}, at another level", then=then)
        try_ = say("log with {word}(...) when the level crosses {percent} %, once", word=word, percent=threshold)
        judge.expect(len(found) == 1, seen, try_)
        seen += say("; it logged {m.data[msg]!r} at {m.t:.1f} s", m=found[0])
        try_ = say("compare percent (BatteryState.percentage is 0 to 1) with the parameter's value, not its default")
        judge.expect(found[0] in then, seen, try_)


def battery_logs(messages: list[Message], level: int) -> list[Message]:
    """Return what the node itself has logged at a level about the battery, or about anything if nothing about that."""
    found = [m for m in _own_logs(messages) if m.data["level"] == level]
    return [m for m in found if "batter" in str(m.data["msg"]).lower()] or found


def _own_logs(messages: list[Message]) -> list[Message]:
    """Return what came from the node's own logger, or from a child of it such as sensor_processor.battery."""
    return [m for m in messages if m.topic == "rosout" and "sensor_processor" in m.data.get("name", "").split(".")]


def test_publishes_at_the_fusion_frequency(judge: Judge) -> None:
    """`sensor_fusion_data` and `obstacle_distance` come at `fusion_frequency` ± 20 % once a scan has been seen."""
    trial, _ = _fused(judge)
    _expect_rate(judge, trial, trial.marks["scans"] + 0.4, _SLOWEST_HZ)
    fine = judge.trial("fine_clock")
    if fine.measured["held"] <= 1:  # else it is I7's: by a timer on wall time any rate shows here
        _expect_rate(judge, fine, fine.marks["fine"], 0.0)


def _expect_rate(judge: Judge, trial: Trial, start: float, slowest: float) -> None:
    end = trial.marks["end"]
    for topic in ("sensor_fusion_data", "obstacle_distance"):
        hertz = sum(m.topic == topic and start < m.t <= end for m in trial.messages) / (end - start)
        near = "" if hertz else near_topic(trial.graph, topic)
        seen = say("{topic} at {hertz:.1f} Hz of simulated time{near}", topic=topic, hertz=hertz, near=near)
        judge.expect(slowest <= hertz <= _FASTEST_HZ, seen, _TRY_RATE)


def test_publishes_nothing_before_the_first_scan(judge: Judge) -> None:
    """Nothing is published before the first scan; the stamp is the node's clock and the frame is `base_link`."""
    trial, fused = _fused(judge)
    early = [m for m in trial.messages if m.t < trial.marks["scans"] + 1e-9]
    seen = say("{n} messages before the first scan", n=len(early))
    judge.expect(not early, seen, say("remember whether a scan has come, and publish nothing before"))
    frames = {m.data["header"]["frame_id"] for m in fused}
    judge.expect(frames == {"base_link"}, say("frame_id {frames}", frames=sorted(frames)), say("set header.frame_id"))
    t, worst = max(((motion.stamp(m), m) for m in fused), key=lambda pair: abs(pair[0] - pair[1].t))
    seen = say("a stamp of {t:.2f} s at {m.t:.2f} s of simulated time", t=t, m=worst)
    judge.expect(abs(t - worst.t) <= LATE_S[trial.pace] + 1e-6, seen, "self.get_clock().now().to_msg()")


def _fused(judge: Judge) -> tuple[Trial, list[Message]]:
    trial, topic = judge.trial("fusion"), "sensor_fusion_data"
    fused = [m for m in trial.messages if m.topic == topic]
    if not fused:
        raise NotReached(say("no message on {topic}{near}", topic=topic, near=near_topic(trial.graph, topic)))
    return trial, fused


def _fused_without_readings(judge: Judge) -> tuple[Trial, list[Message]]:
    """Return the trial whose scans have no valid reading; fail if it published nothing meanwhile.

    Before the first message of all nothing is missed: F13 judges when the stream begins.
    """
    trial = judge.trial("nothing_to_fuse", complete=False)
    if trial.ended and not trial.marks:
        raise judge.not_reached(trial.ended, trial)
    fused = [m for m in trial.messages if m.topic == "sensor_fusion_data"]
    marks = [*sorted(trial.marks.items(), key=lambda item: item[1]), ("", math.inf)]
    for (kind, start), (_, end) in itertools.pairwise(marks):
        if kind == "end":
            continue
        words = mark("scans with {kind}: {trial.ended}{last}")
        seen = say(words, kind=kind, trial=trial, last=last_output(trial))
        judge.expect(math.isfinite(end), seen, motion.TRY_MIN)
        if any(m.t <= start + 1e-9 for m in fused):
            came = any(start + LATE_S[trial.pace] < m.t <= end + 1e-9 for m in fused)
            seen = say("scans with {kind}: no fused data came", kind=kind)
            judge.expect(came, seen, say("that nothing is near is data, too: publish inf"))
    return trial, fused


def expect_followed(trial: Trial, fused: list[Message], field: str, try_: str) -> None:
    """Expect each fused message to have the latest measurement; one just before the message may be missing from it."""
    (topic, tolerance), measured = _SOURCES[field], _measured(trial, field)
    for message in fused:
        said = _numbers(message.data[field])
        known = [value for t, value in measured if t <= message.t + 1e-9]
        recent = [value for t, value in measured if message.t - LATE_S[trial.pace] <= t <= message.t + 1e-9]
        candidates = known[-1 - len(recent) :]
        if candidates and not any(_same(said, value, tolerance) for value in candidates):
            words = mark("{field} {said} at {t:.2f} s, when {true} had been measured")
            seen = say(words, field=field, said=_show(said), t=message.t, true=_show(candidates[-1]))
            heard = {e.topic for e in trial.graph.endpoints if e.kind == "subscription"} if trial.graph else {topic}
            if topic not in heard:
                seen = say("the node does not subscribe to {topic}: {seen}", topic=topic, seen=seen)
                try_ = say("compare the names of the subscriptions with the contract's table letter by letter")
            raise Failed(seen, try_)


def _measured(trial: Trial, field: str) -> list[tuple[float, list[float]]]:
    """Return (t, numbers) of all that a field should have had; of battery and IMU there is a value from the start."""
    topic, _ = _SOURCES[field]
    if topic == "raw_scan":
        return [(scan.t, [scan.anywhere]) for scan in trial.scans]
    sent = [m for m in trial.published if m.topic == topic]
    if topic == "battery/state":
        return [(-math.inf, [100.0]), *((m.t, [100.0 * m.data["percentage"]]) for m in sent)]
    return [(-math.inf, [0.0, 0.0, 0.0]), *((m.t, _numbers(m.data[field])) for m in sent)]


def _numbers(value: Any) -> list[float]:
    """Return a number, or a vector as it stands in a message, as numbers."""
    value = [value[axis] for axis in "xyz"] if isinstance(value, dict) else value
    return [float(item) for item in value] if isinstance(value, list) else [float(value)]


def _same(said: list[float], true: list[float], tolerance: float) -> bool:
    """Return whether numbers are equal, or differ by `tolerance` at most. NaN is not."""
    return all(a == b or abs(a - b) <= tolerance for a, b in zip(said, true, strict=True))


def _show(numbers: list[float]) -> str:
    text = ", ".join(f"{number:.2f}" for number in numbers)
    return f"({text})" if len(numbers) > 1 else text
