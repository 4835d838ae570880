"""The checks of the notebook on frames: they accept the solution, refuse each usual mistake, and say what was wrong."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from grader.notebook.frames import check, place, read_bag, seconds, transform
from rclpy.utilities import ok

from grader.authoring import notebook_source
from grader.notebook import tables
from sim import TB4, Pose, Simulator, Twist, World, drive
from sim.bag import write_bag

NAME = "12_frames"


def solved(old: str = "", new: str = "") -> dict[str, Any]:
    """Return the solution's functions, after an edit."""
    text = notebook_source.functions(NAME)
    assert text.count(old) >= 1
    names: dict[str, Any] = {}
    exec(text.replace(old, new) if old else text, names)
    return names


def answer(task: str, names: dict[str, Any]) -> str:
    functions = {
        "TF1": ("compose", "inverse"),
        "TF2": ("at",),
        "TF3": ("lookup",),
        "TF4": ("stamped", "turned", "names"),
    }[task]
    return repr(check(task, *(names[name] for name in functions)))


@pytest.mark.parametrize("task", ["TF1", "TF2", "TF3", "TF4"])
def test_the_solution_passes(task: str):
    assert answer(task, solved()) == f"{task} passed"


MISTAKES = [
    ("TF1", "x + cos * b[0] - sin * b[1], y + sin", "x + cos * b[0] + sin * b[1], y - sin", "turn b's x and y"),
    ("TF1", "-cos * x - sin * y, sin * x - cos * y, -yaw", "-x, -y, -yaw", "turned by -yaw"),
    ("TF2", "time > last", "False", "IndexError"),
    ("TF2", "after = bisect_left(messages, time, key=seconds)", "return place(messages[-1])", "around the time"),
    ("TF2", "math.remainder(end[2] - start[2], math.tau)", "end[2] - start[2]", "the yaw takes the short way"),
    ("TF2", "raise ExtrapolationException(f\"into the past", "return 0, 0, 0  # (f\"", "0.01 s before the first"),
    ("TF3", "compose(inverse(buffer.placed(target, time)), ", "compose(buffer.placed(target, time), ", "target first"),
    ("TF3", "if depth(source) >= depth(target)", "if depth(source)", "both are bolted to base_link"),
    ("TF3", "raise LookupError(", "return (0.0, 0.0, 0.0)  # (", "frames of different trees"),
    ("TF3", "    if source == target:\n        return 0.0, 0.0, 0.0\n", "", "map and map are not in one tree"),
    ("TF4", "result = TwistStamped(twist=command)", "return command", "a TwistStamped whose twist is v = 0.17"),
    ("TF4", "result.header.stamp = now", "", "the stamp is 0 s"),
    ("TF4", "copy.deepcopy(scan)", "scan", "you have changed the scan that came in"),
    ("TF4", "result.angle_min += yaw", "result.angle_min -= yaw", "each reading where it was measured"),
    ("TF4", '"imu/data": "imu"', '"imu/data": "imu/data"', "names('') is"),
]  # fmt: skip


@pytest.mark.parametrize(("task", "old", "new", "said"), MISTAKES, ids=[f"{m[0]}-{m[3]}" for m in MISTAKES])
def test_a_mistake_is_refused_with_what_was_seen_and_expected(task: str, old: str, new: str, said: str):
    text = answer(task, solved(old, new))
    assert text.startswith(f"{task} not yet\n")
    assert "    seen " in text
    assert "    expected " in text
    assert said in " ".join(text.split())


def test_readings_in_another_order_are_as_good_as_other_angles():
    """A scan is also turned if its readings are rolled by 90 beams and its angles stay."""
    names = solved()

    def rolled(scan: Any, yaw: float) -> Any:
        result = names["turned"](scan, yaw)
        beams = round(yaw / scan.angle_increment)
        result.ranges = scan.ranges[-beams:] + scan.ranges[:-beams]
        result.angle_min, result.angle_max = scan.angle_min, scan.angle_max
        result.angle_min += yaw - beams * scan.angle_increment
        return result

    assert check("TF4", names["stamped"], rolled, names["names"]).passed


def test_a_bag_is_read_as_it_was_written(tmp_path: Path):
    recording = drive(Simulator(World(), TB4), lambda _: Twist(0.2, 0.0), 1.0)
    write_bag(recording, tmp_path / "bag")
    scans, commands = read_bag(tmp_path / "bag", "/scan"), read_bag(tmp_path / "bag", "/cmd_vel")
    assert len(scans) == len(recording.scan_t)
    assert type(commands[-1]).__name__ == "TwistStamped"
    assert commands[-1].twist.linear.x == 0.2


def test_a_function_that_gives_no_place_is_refused():
    for nonsense in (lambda *_: None, lambda *_: 3.0, lambda *_: (1.0, 2.0)):
        assert not check("TF1", nonsense, nonsense).passed
        assert not check("TF2", nonsense).passed
        assert not check("TF3", nonsense).passed


def test_a_lookup_that_never_ends_is_said_to_hang_also_before_rclpy_is_initialized(monkeypatch: pytest.MonkeyPatch):
    """The thread that interrupts it then found no executor to wake, and its traceback was shown."""
    assert not ok()
    monkeypatch.setattr(tables, "LIMIT_S", 0.2)

    def climb(*_: object) -> None:
        while True:
            pass

    assert "hangs at" in repr(check("TF3", climb))


def test_a_transform_keeps_its_place_and_its_stamp():
    message = transform("odom", "base_link", 12.05, (1.0, -2.0, 3.1))
    assert (message.header.frame_id, message.child_frame_id) == ("odom", "base_link")
    assert (message.header.stamp.sec, message.header.stamp.nanosec) == (12, 50_000_000)
    assert seconds(message) == pytest.approx(12.05)
    assert place(message) == pytest.approx((1.0, -2.0, 3.1))


def test_the_solutions_arithmetic_is_the_simulators():
    names = solved()
    compose: Callable[..., Any] = names["compose"]
    a, b = Pose(1.0, -2.0, 2.5), Pose(0.3, 0.4, 1.5)
    c = a.compose(b)
    x, y, yaw = compose((a.x, a.y, a.yaw), (b.x, b.y, b.yaw))
    assert (x, y) == pytest.approx((c.x, c.y))
    assert math.remainder(yaw - c.yaw, math.tau) == pytest.approx(0.0)
