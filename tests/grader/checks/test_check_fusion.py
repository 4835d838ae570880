"""F12 and F13: which measurements a fused message may have, and how late it may be, by the pace of its trial."""

from __future__ import annotations

from typing import Any

import pytest
from helpers.judging import Check, Judged, ask, evidence_with, trial

from grader import evidence
from grader.courses.robot_controller.checks import check_fusion as checks

TICK = 0.05


def said_of(check: Check, name: str = "fusion", pace: str = "lockstep", **facts: Any) -> Judged:
    """Return what a check says of a trial of the sensor processor with these facts."""
    run = trial(name, "sensor_processor", pace=pace, marks={"scans": 0.0}, **facts)
    return ask(check, evidence_with(trials={name: run}))


def judged(check: Check, pace: str, late_ticks: int) -> str:
    """Return what a check finds wrong with fused data that come so late, "" if nothing.

    An IMU publishes 1, 2, 3 at one tick after the other; each is fused at once and arrives `late_ticks` later.
    """

    def at(n: int) -> dict[str, list[float]]:
        return {"linear_acceleration": [n, 0.0, 9.8], "angular_velocity": [0.0, 0.0, n]}

    measured = [evidence.Message(n * TICK, "imu/data", at(n)) for n in range(1, 20)]
    fused = [
        evidence.Message(imu.t + late_ticks * TICK, "sensor_fusion_data", {
            "header": {"stamp": {"sec": 100, "nanosec": round(imu.t * 1e9)}, "frame_id": "base_link"},
            "linear_acceleration": {"x": float(n), "y": 0.0, "z": 9.8},
            "angular_velocity": {"x": 0.0, "y": 0.0, "z": float(n)},
        })
        for n, imu in enumerate(measured, 1)
    ]  # fmt: skip
    return said_of(check, pace=pace, messages=fused, published=measured).seen


BOTH = pytest.mark.parametrize(
    "check", [checks.test_fuses_the_latest_imu_message, checks.test_publishes_nothing_before_the_first_scan]
)


@BOTH
@pytest.mark.parametrize(("pace", "late"), [("lockstep", 0), ("lockstep", 2), ("real time", 3), ("real time", 6)])
def test_a_message_delayed_by_a_busy_machine_costs_nothing(check: Check, pace: str, late: int):
    """A correct processor that sleeps by wall time lost F12 and F13 to a single message, three ticks late."""
    assert judged(check, pace, late) == ""


@BOTH
@pytest.mark.parametrize(("pace", "late"), [("lockstep", 3), ("real time", 8)])
def test_an_old_measurement_fails(check: Check, pace: str, late: int):
    assert judged(check, pace, late)


def battery_judged(*logs: tuple[float, int, str], logger: str = "sensor_processor") -> str:
    """Return what is said of a battery that falls by 5 % a second from 60 %, and of these logs (t, level, words)."""
    published = [evidence.Message(float(n), "battery/state", {"percentage": 0.6 - 0.05 * n}) for n in range(12)]
    messages = [evidence.Message(t, "rosout", {"name": logger, "level": level, "msg": said}) for t, level, said in logs]
    check = checks.test_battery_alarms_are_logged_once
    said = said_of(check, "battery_runs_down", messages=messages, published=published)
    return f"{said.seen}, {said.try_}"


WARNED, CRITICAL = (7.0, 30, "Battery low"), (10.0, 40, "Battery critical")


@pytest.mark.parametrize(
    ("low", "critical", "said"),
    [
        (20, 40, "; then it logged 'Battery low', at another level, log with warning(...) when the level"),
        (40, 30, "it logged 'Battery low' at 7.0 s"),
        (30, 30, "; then it logged 'Battery critical', at another level, log with error(...) when the level"),
    ],
)
def test_an_alarm_at_another_level_is_named(low: int, critical: int, said: str):
    """A node that logged a low battery as information heard that it should not log at every message."""
    assert said in battery_judged((7.0, low, "Battery low"), (10.0, critical, "Battery critical"))


@pytest.mark.parametrize("logger", ["sensor_processor", "sensor_processor.battery", "left.sensor_processor"])
def test_right_alarms_and_other_logs_lose_nothing(logger: str):
    """get_logger().get_child('battery') logs as sensor_processor.battery; its alarms were not seen."""
    assert battery_judged(WARNED, (7.0, 20, "battery at 25 %"), CRITICAL, logger=logger) == ", "


def test_a_topic_that_is_not_subscribed_is_the_first_cause():
    """A subscription of `imu` was reported as a vector that had not been copied."""
    fused = {"linear_acceleration": dict.fromkeys("xyz", 0.0), "angular_velocity": dict.fromkeys("xyz", 0.0)}
    imu = evidence.Endpoint("imu", "subscription", "sensor_processor", "Imu", "reliable")
    said = said_of(
        checks.test_fuses_the_latest_imu_message, graph=evidence.Graph(endpoints=[imu]),
        published=[evidence.Message(1.0, "imu/data", {field: [1.0, 0.0, 0.0] for field in fused})],
        messages=[evidence.Message(2.0, "sensor_fusion_data", fused)],
    )  # fmt: skip
    assert said.seen.startswith("the node does not subscribe to imu/data: linear_acceleration")
