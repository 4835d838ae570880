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
