"""F12 and F13: what the sensor processor publishes, and when."""

import math
from collections.abc import Callable
from typing import Any

from grader.checks.first_cause import last_output
from grader.checks.judge import Failed, Judge, NotReached
from grader.checks.wording import near_topic
from grader.evidence import Message, Trial
from grader.words import mark, say

_TICK_S = 0.05
# How late a message may be. In lockstep it answers its tick; in real time a busy machine delays it: by three ticks,
# as measured.
_LATE_S = {"lockstep": 2 * _TICK_S, "real time": 6 * _TICK_S}
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
    expect_distances(trial, [message for message in fused if message.t < edge], try_)
    expect_distances(*_fused_without_readings(judge), try_)
    try:
        expect_distances(trial, [message for message in fused if message.t >= edge], try_)
    except Failed as failed:
        seen = say("{failed.seen}, which is range_min itself", failed=failed)
        judge.share(0.5, seen, say("range_min <= reading <= range_max: the limits themselves are valid"))


def test_fuses_the_battery_in_percent(judge: Judge) -> None:
    """`battery_level` is in percent, 0 to 100; 100.0 before the first battery message."""
    trial, fused = _fused(judge)
    measured = [(-math.inf, 100.0)]
    measured += [(m.t, 100.0 * m.data["percentage"]) for m in trial.published if m.topic == "battery/state"]
    off = [min(abs(float(m.data["battery_level"]) - level) for _, level in measured) for m in fused]
    expect_followed(
        trial, fused, "battery_level", "battery/state", measured, lambda said, true: same(said, true, 0.1),
        say("publish the level as it is, with its decimals: do not round it, nor cut it to an int")
        if any(0.1 < difference < 1.0 for difference in off)
        else say("BatteryState.percentage is 0 to 1; start with 100.0"),
    )  # fmt: skip


def test_fuses_the_latest_imu_message(judge: Judge) -> None:
    """Acceleration and angular velocity are those of the latest IMU message, zero before the first."""
    trial, fused = _fused(judge)
    for field in ("linear_acceleration", "angular_velocity"):
        measured: list[tuple[float, Any]] = [(-math.inf, [0.0, 0.0, 0.0])]
        measured += [(m.t, m.data[field]) for m in trial.published if m.topic == "imu/data"]
        try_ = say("keep the latest Imu message and copy both vectors from it")
        expect_followed(trial, fused, field, "imu/data", measured, same_vector, try_)


def test_battery_alarms_are_logged_once(judge: Judge) -> None:
    """Battery below the low threshold is logged as a warning once, below the critical threshold as an error once."""
    trial = judge.trial("battery_runs_down")
    # The node's own logger, or a child of it such as sensor_processor.battery.
    logs = [
        m for m in trial.messages if m.topic == "rosout" and "sensor_processor" in m.data.get("name", "").split(".")
    ]
    alarms = [(_WARN, "warning", mark("warnings"), 30), (_ERROR, "error", mark("errors"), 15)]
    logged = [m.data["level"] for m in logs]
    if logged.count(_WARN) > 1 and _ERROR not in logged:
        alarms.reverse()  # one of the warnings should be the error
    for level, word, kind, threshold in alarms:
        found = [m for m in logs if m.data["level"] == level]
        about = [m for m in found if "batter" in str(m.data["msg"]).lower()] or found
        seen = say("{n} {kind} while the battery fell from 60 to 5 %", n=len(about), kind=say(kind))
        if about:
            seen += say(", the first at {about[0].t:.1f} s: {about[0].data[msg]!r}", about=about)
        seen += say("; the thresholds were set to 30 and 15 %")
        levels = [(m.t, 100.0 * m.data["percentage"]) for m in trial.published if m.topic == "battery/state"]
        crossed = next(t for t, percent in levels if percent < threshold)
        then = [m for m in logs if crossed - 1e-9 <= m.t <= crossed + _BATTERY_S + _LATE_S[trial.pace]]
        other = next((m for m in then if "batter" in str(m.data["msg"]).lower()), None)
        if other and not any(m.data["level"] == level for m in then):
            seen += say("; at {other.t:.1f} s it logged {other.data[msg]!r} at another level", other=other)
            raise Failed(seen, say("log it with self.get_logger().{word}(...)", word=word))
        judge.expect(
            len(about) == 1,
            seen,
            say("log when the level crosses {threshold} %, not at every message", threshold=threshold),
        )
        seen += say("; the level fell below {threshold} % at {crossed:.1f} s", threshold=threshold, crossed=crossed)
        try_ = say("compare percent with percent: BatteryState.percentage is 0 to 1")
        late = say("compare with the parameter's value, not with its default")
        judge.expect(about[0] in then, seen, try_ if about[0].t < crossed else late)


def test_publishes_at_the_fusion_frequency(judge: Judge) -> None:
    """`sensor_fusion_data` and `obstacle_distance` come at `fusion_frequency` ± 20 % once a scan has been seen."""
    trial, _ = _fused(judge)
    for topic in ("sensor_fusion_data", "obstacle_distance"):
        hertz = _rate(trial, topic, trial.marks["scans"] + 0.4)
        seen = say(
            "{topic} at {hertz:.1f} Hz of simulated time{near_topic}",
            topic=topic,
            hertz=hertz,
            near_topic=near_topic(trial.graph, topic) if not hertz else "",
        )
        judge.expect(_SLOWEST_HZ <= hertz <= _FASTEST_HZ, seen, _TRY_RATE)
    fine = judge.trial("fine_clock")
    if fine.measured["held"] > 1:
        return  # I7's: by a timer on wall time any rate shows above
    for topic in ("sensor_fusion_data", "obstacle_distance"):
        hertz = _rate(fine, topic, fine.marks["fine"])
        judge.expect(
            hertz <= _FASTEST_HZ,
            say("{topic} at {hertz:.1f} Hz of simulated time", topic=topic, hertz=hertz),
            _TRY_RATE,
        )


def _rate(trial: Trial, topic: str, start: float) -> float:
    end = trial.marks["end"]
    return sum(m.topic == topic and start < m.t <= end for m in trial.messages) / (end - start)


def test_publishes_nothing_before_the_first_scan(judge: Judge) -> None:
    """Nothing is published before the first scan; the stamp is the node's clock and the frame is `base_link`."""
    trial, fused = _fused(judge)
    early = [m for m in trial.messages if m.t < trial.marks["scans"] + 1e-9]
    seen = say("{n} messages before the first scan", n=len(early))
    judge.expect(not early, seen, say("remember whether a scan has come, and publish nothing before"))
    frames = {m.data["header"]["frame_id"] for m in fused}
    judge.expect(frames == {"base_link"}, say("frame_id {frames}", frames=sorted(frames)), say("set header.frame_id"))
    worst = max(fused, key=lambda m: abs(stamp(m) - m.t))
    seen = say("a stamp of {stamp:.2f} s at {worst.t:.2f} s of simulated time", stamp=stamp(worst), worst=worst)
    judge.expect(abs(stamp(worst) - worst.t) <= _LATE_S[trial.pace] + 1e-6, seen, "self.get_clock().now().to_msg()")


def stamp(message: Message) -> float:
    """Return a header's stamp in seconds since the trial began (ROS time 100 s)."""
    stamp = message.data["header"]["stamp"]
    return float(stamp["sec"]) - 100.0 + float(stamp["nanosec"]) * 1e-9


def _fused(judge: Judge) -> tuple[Trial, list[Message]]:
    trial = judge.trial("fusion")
    fused = [m for m in trial.messages if m.topic == "sensor_fusion_data"]
    if not fused:
        raise NotReached(
            say(
                "no message on sensor_fusion_data{near_topic}", near_topic=near_topic(trial.graph, "sensor_fusion_data")
            )
        )
    return trial, fused


def _fused_without_readings(judge: Judge) -> tuple[Trial, list[Message]]:
    """Return the trial whose scans have no valid reading; fail if it published nothing meanwhile.

    Before the first message of all nothing is missed: F13 judges when the stream begins.
    """
    trial = judge.trial("nothing_to_fuse", complete=False)
    if trial.ended and not trial.marks:
        raise judge.not_reached(trial.ended, trial)
    fused = [m for m in trial.messages if m.topic == "sensor_fusion_data"]
    marks = sorted(trial.marks.items(), key=lambda item: item[1])
    for index, (kind, start) in enumerate(marks):
        if kind == "end":
            continue
        over = index + 1 < len(marks)
        seen = say(
            "scans with {kind}: {trial.ended}{last_output}", kind=kind, trial=trial, last_output=last_output(trial)
        )
        judge.expect(over, seen, say("min() of nothing raises: min(readings, default=math.inf)"))
        if not any(m.t <= start + 1e-9 for m in fused):
            continue
        came = any(start + _LATE_S[trial.pace] < m.t <= marks[index + 1][1] + 1e-9 for m in fused)
        judge.expect(
            came,
            say("scans with {kind}: no fused data came", kind=kind),
            say("that nothing is near is data, too: publish inf"),
        )
    return trial, fused


def expect_followed(
    trial: Trial,
    fused: list[Message],
    field: str,
    topic: str,
    measured: list[tuple[float, Any]],
    same: Callable[[Any, Any], bool],
    try_: str,
) -> None:
    """Expect each fused message to have the latest measurement; one just before the message may be missing from it."""
    for message in fused:
        said = message.data[field]
        known = [value for t, value in measured if t <= message.t + 1e-9]
        recent = [value for t, value in measured if message.t - _LATE_S[trial.pace] <= t <= message.t + 1e-9]
        candidates = known[-1 - len(recent) :]
        if candidates and not any(same(said, value) for value in candidates):
            seen = say(
                "{field} {show} at {message.t:.2f} s, when {show2} had been measured",
                field=field,
                show=_show(said),
                message=message,
                show2=_show(candidates[-1]),
            )
            heard = {e.topic for e in trial.graph.endpoints if e.kind == "subscription"} if trial.graph else {topic}
            if topic not in heard:
                seen = say("the node does not subscribe to {topic}: {seen}", topic=topic, seen=seen)
                try_ = say("compare the names of the subscriptions with the contract's table letter by letter")
            raise Failed(seen, try_)


def expect_distances(trial: Trial, fused: list[Message], try_: str) -> None:
    """Expect each fused message to have the closest valid reading of the latest scan."""
    scans = [(scan.t, scan.anywhere) for scan in trial.scans]
    field = "closest_obstacle_distance"
    expect_followed(trial, fused, field, "raw_scan", scans, lambda said, true: same(said, true, 0.01), try_)


def same(said: Any, true: Any, tolerance: float) -> bool:
    """Return whether two numbers are equal, or differ by `tolerance` at most. NaN is not."""
    a, b = float(said), float(true)
    return a == b or abs(a - b) <= tolerance


def same_vector(said: Any, true: Any) -> bool:
    """Return whether a vector {x, y, z} is the list of three numbers, to 1e-6."""
    values = [said[axis] for axis in "xyz"]
    return all(same(a, b, 1e-6) for a, b in zip(values, true, strict=True))


def _show(value: Any) -> str:
    if isinstance(value, dict):
        value = [value[axis] for axis in "xyz"]
    if isinstance(value, list):
        return "(" + ", ".join(f"{float(item):.2f}" for item in value) + ")"
    return f"{float(value):.2f}"
