"""F12 and F13: which measurements a fused message may have, and how late it may be, by the pace of its trial."""

from __future__ import annotations

import pytest
from helpers.judging import Check, ask, evidence_with

from grader import evidence
from grader.courses.robot_controller.checks import check_fusion as checks

TICK = 0.05


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
    trial = evidence.Trial(
        "fusion", "sensor_processor", "open_field", 0, True, pace, None, marks={"scans": 0.0}, messages=fused,
        published=measured,
    )  # fmt: skip
    return ask(check, evidence_with(trials={"fusion": trial})).seen


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
    trial = evidence.Trial(
        "battery_runs_down", "sensor_processor", "open_field", 0, True, "lockstep", None, messages=messages,
        published=published,
    )  # fmt: skip
    said = ask(checks.test_battery_alarms_are_logged_once, evidence_with(trials={"battery_runs_down": trial}))
    return f"{said.seen}, {said.try_}"


def test_an_alarm_at_another_level_is_named():
    """A node that logged a low battery as information heard that it should not log at every message."""
    said = battery_judged((7.0, 20, "Battery low"), (10.0, 40, "Battery critical"))
    assert "0 warnings" in said
    assert "at 7.0 s it logged 'Battery low' at another level, log it with self.get_logger().warning(...)" in said
    exchanged = battery_judged((7.0, 40, "Battery low"), (10.0, 30, "Battery critical"))
    assert "at 7.0 s it logged 'Battery low' at another level" in exchanged
    both_warn = battery_judged((7.0, 30, "Battery low"), (10.0, 30, "Battery critical"))
    assert "at 10.0 s it logged 'Battery critical' at another level, log it with self.get_logger().error(" in both_warn


def test_right_alarms_and_other_logs_lose_nothing():
    assert (
        battery_judged((7.0, 30, "Battery low"), (7.0, 20, "battery at 25 %"), (10.0, 40, "Battery critical")) == ", "
    )


@pytest.mark.parametrize("logger", ["sensor_processor.battery", "left.sensor_processor"])
def test_alarms_of_a_child_logger_count(logger: str):
    """get_logger().get_child('battery') logs as sensor_processor.battery; its alarms were not seen."""
    assert battery_judged((7.0, 30, "Battery low"), (10.0, 40, "Battery critical"), logger=logger) == ", "


@pytest.mark.parametrize(
    ("level", "try_"),
    [
        (24.0, "publish the level as it is, with its decimals"),
        (0.245, "BatteryState.percentage is 0 to 1"),
        (100.0, "B"),
    ],
)
def test_a_level_that_was_cut_to_an_int_is_told_from_a_ratio(level: float, try_: str):
    trial = evidence.Trial(
        "fusion", "sensor_processor", "open_field", 0, True, "lockstep", None, marks={"scans": 0.0},
        published=[evidence.Message(1.0, "battery/state", {"percentage": 0.245})],
        messages=[evidence.Message(2.0, "sensor_fusion_data", {"battery_level": level})],
    )  # fmt: skip
    assert ask(checks.test_fuses_the_battery_in_percent, evidence_with(trials={"fusion": trial})).try_.startswith(try_)


def test_a_topic_that_is_not_subscribed_is_the_first_cause():
    """A subscription of `imu` was reported as a vector that had not been copied."""
    fused = {"linear_acceleration": dict.fromkeys("xyz", 0.0), "angular_velocity": dict.fromkeys("xyz", 0.0)}
    trial = evidence.Trial(
        "fusion", "sensor_processor", "open_field", 0, True, "lockstep", None, marks={"scans": 0.0},
        published=[evidence.Message(1.0, "imu/data", {field: [1.0, 0.0, 0.0] for field in fused})],
        messages=[evidence.Message(2.0, "sensor_fusion_data", fused)],
        graph=evidence.Graph(
            endpoints=[evidence.Endpoint("imu", "subscription", "sensor_processor", "Imu", "", "reliable")]
        ),
    )  # fmt: skip
    said = ask(checks.test_fuses_the_latest_imu_message, evidence_with(trials={"fusion": trial})).seen
    assert said.startswith("the node does not subscribe to imu/data: linear_acceleration")
