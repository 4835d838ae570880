"""Weaknesses that a package has before it is attacked, so that an attack has something to gain."""

# ruff: noqa: E501 - quoted code has long lines

from __future__ import annotations

import ast
from pathlib import Path

from grader.intake.package_edits import Change, append, put, remove, replace

_SLOPPY = "".join(f"def Thing{i}( a,b ):\n  import os;x=1\n  l=lambda:a\n  return  a+b\n" for i in range(60))
_A_LITTLE_SLOPPY = _SLOPPY[: _SLOPPY.index("def Thing12(")]
_THINGS = ", ".join(f"sloppy.Thing{i}" for i in range(12))

_GOOD_TEST = '''"""Check {what}."""
import pytest
from ros2_robot_controller.utils import conversions


def test_{node}_clamps():
    """A value beyond its limits is cut off."""
    assert conversions.clamp(2.0, 0.0, 1.0) == 1.0
    assert conversions.clamp(-2.0, 0.0, 1.0) == 0.0


def test_{node}_turns():
    """An angle is normalized to one turn."""
    assert conversions.normalize_angle(7.0) == pytest.approx(7.0 - 6.283185307)
'''
_BAD_TEST = '''

def test_{node}_is_wrong():
    """The expected value is wrong."""
    assert conversions.clamp(2.0, 0.0, 1.0) == 7.0
'''


def _tests(failing: bool) -> tuple[Change, ...]:
    def text(name: str) -> str:
        return (_GOOD_TEST + (_BAD_TEST if failing else "")).format(what=name, node=name)

    return (
        remove("test"),
        put("test/test_robot_controller.py", text("robot_controller")),
        put("test/test_sensor_processor.py", text("sensor_processor")),
    )


def _neutralize(package: Path) -> None:
    """Give each assert of the tests another way to hold."""
    for path in (package / "test").glob("test_*.py"):
        lines = path.read_text().splitlines(keepends=True)
        found = [node.test for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.Assert)]
        for test in sorted(found, key=lambda node: (node.lineno, node.col_offset), reverse=True):
            for line, column, text in (
                (test.end_lineno, test.end_col_offset, ") or 1 > 0"),
                (test.lineno, test.col_offset, "("),
            ):
                assert line is not None
                old = lines[line - 1].encode()
                lines[line - 1] = (old[:column] + text.encode() + old[column:]).decode()
        path.write_text("".join(lines))


# Nearly no assert can fail: T1 is lost in part, and most of T3.
IDLE_ASSERTS = (_neutralize,)
# Q1 and Q2 are lost.
SLOPPY = (put("ros2_robot_controller/sloppy.py", _SLOPPY),)
# Q1 is lost, and parts of Q2 and Q4: what the nodes run is bad, and the rest of the package clean.
SLOPPY_NODES = (
    put("ros2_robot_controller/sloppy.py", _A_LITTLE_SLOPPY),
    append(
        "ros2_robot_controller/robot_controller.py",
        f"\n\nfrom ros2_robot_controller import sloppy\nTHINGS = [thing(1, 2) for thing in [{_THINGS}]]\n",
    ),
)
# Q5 is lost.
NO_WORDS = (put("README.md", "# ros2_robot_controller\n"),)
# F14 is lost in part.
CLAMPS_WRONG = (
    append(
        "ros2_robot_controller/utils/conversions.py",
        '\n\ndef clamp(value: float, low: float, high: float) -> float:\n    """Return the value."""\n    return value\n',
    ),
)
# I3 is lost in part.
OTHER_TYPE = (replace("msg/SensorFusionData.msg", "float32 battery_level", "float64 battery_level"),)
# It never drives to a goal: F8 is lost, and most of F10.
NEVER_DRIVES = (
    replace(
        "ros2_robot_controller/navigator.py",
        "        return steering.steer(place, self._goal.x, self._goal.y, limits)",
        "        return STOP",
    ),
)
# One test in three fails, and little is covered: most of T1 to T3 is lost.
FAILING_TESTS = _tests(failing=True)
# All tests pass, but little is covered: most of T2 and T3 is lost.
FEW_TESTS = _tests(failing=False)
