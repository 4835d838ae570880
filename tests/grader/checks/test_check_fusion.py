"""What a fused message may hold, and how late it may be, by the pace of its trial."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from grader import evidence
from grader.checks import check_fusion as checks
from grader.checks.judge import Failed, Judge

TICK = 0.05


def judged(check: Callable[[Judge], None], pace: str, late_ticks: int) -> str:
    """Return what a check has against fused data that come so late, "" for nothing.

    An IMU speaks at every tick, 1, 2, 3, and each of its messages is fused at once and arrives `late_ticks` later.
    """

    def at(n: int) -> dict[str, list[float]]:
        return {"linear_acceleration": [n, 0.0, 9.8], "angular_velocity": [0.0, 0.0, n]}

    told = [evidence.Message(n * TICK, "imu/data", at(n)) for n in range(1, 20)]
    fused = [
        evidence.Message(said.t + late_ticks * TICK, "sensor_fusion_data", {
            "header": {"stamp": {"sec": 100, "nanosec": round(said.t * 1e9)}, "frame_id": "base_link"},
            "linear_acceleration": {"x": float(n), "y": 0.0, "z": 9.8},
            "angular_velocity": {"x": 0.0, "y": 0.0, "z": float(n)},
        })
        for n, said in enumerate(told, 1)
    ]  # fmt: skip
    trial = evidence.Trial(
        "fusion", "sensor_processor", "open_field", 0, True, pace, "", marks={"scans": 0.0}, messages=fused,
        published=told,
    )  # fmt: skip
    judge = Judge(
        evidence.Evidence(
            intake=evidence.Intake("team07.zip", "", "ros2_robot_controller", "."),
            build=evidence.Build(True, True, 0.0, 0, False, ""),
            trials={"fusion": trial},
        )
    )
    try:
        check(judge)
    except Failed as failed:
        return failed.seen
    return ""


BOTH = pytest.mark.parametrize(
    "check", [checks.test_fuses_the_latest_imu_message, checks.test_publishes_nothing_before_the_first_scan]
)


@BOTH
@pytest.mark.parametrize(("pace", "late"), [("lockstep", 0), ("lockstep", 2), ("real time", 3), ("real time", 6)])
def test_a_message_held_up_by_a_busy_machine_is_no_fault(check: Callable[[Judge], None], pace: str, late: int):
    """A correct processor that sleeps by wall time lost F12 and F13 to a single message, three ticks late."""
    assert judged(check, pace, late) == ""


@BOTH
@pytest.mark.parametrize(("pace", "late"), [("lockstep", 3), ("real time", 8)])
def test_old_news_is_a_fault(check: Callable[[Judge], None], pace: str, late: int):
    assert judged(check, pace, late)
