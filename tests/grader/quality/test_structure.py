"""Q3: layout and complexity."""

from __future__ import annotations

from pathlib import Path

import pytest
from helpers.quality_examples import facts, judged, reference, with_linters, written

from grader.checks.check_structure import test_layout_matches_the_contract as layout
from grader.checks.check_structure import test_no_function_is_too_complex as complexity

# -- layout -----------------------------------------------------------------------------------------------------------


def test_files_elsewhere_under_their_name_are_pointed_out(tmp_path: Path):
    """Everything is in one folder."""
    names = ["package.xml", "CMakeLists.txt", "robot_controller.py", "sensor_processor.py", "SetSpeed.srv"]
    result = judged(layout, facts(written(tmp_path, dict.fromkeys(names, "# text\n"))))
    assert result.share < 0.15
    assert "perhaps meant: robot_controller.py" in result.seen


def test_launch_files_with_the_other_common_ending_are_pointed_out(tmp_path: Path):
    package = reference(tmp_path)
    (package / "launch" / "robot_controller_launch.py").rename(package / "launch" / "robot_controller.launch.py")
    result = judged(layout, facts(package))
    assert "perhaps meant: launch/robot_controller.launch.py" in result.seen


def test_interfaces_may_be_in_a_package_of_their_own(tmp_path: Path):
    package = reference(tmp_path)
    beside = tmp_path / "ros2_robot_controller_interfaces"
    for folder in ("msg", "srv", "action"):
        beside.mkdir(exist_ok=True)
        (package / folder).rename(beside / folder)
    (package / "CMakeLists.txt").rename(beside / "CMakeLists.txt")  # what is left may be an ament_python package
    assert judged(layout, facts(package)).share < 1
    assert judged(layout, facts(package, beside)).share == 1.0


def test_additional_files_are_allowed(tmp_path: Path):
    extra = {"docs/notes.md": "x", "test/test_more.py": "def test(): assert 1\n", "rviz/robot.rviz": "x"}
    assert judged(layout, facts(reference(tmp_path, files=extra))).share == 1.0


# -- complexity -------------------------------------------------------------------------------------------------------


def branches(number: int) -> str:
    """Return a function with `number` branches, which has a complexity of number + 1."""
    return (
        "def decide(x):\n"
        + "".join(f"    if x == {n}:\n        return {n}\n" for n in range(number))
        + "    return x\n"
    )


@pytest.mark.parametrize(("number", "sign", "allowed"), [(9, "", True), (10, "  # noqa: C901", False)])
def test_a_complexity_of_10_is_allowed_and_noqa_hides_no_more(tmp_path: Path, number: int, sign: str, allowed: bool):
    text = branches(number).replace("def decide(x):", f"def decide(x):{sign}")
    assert (judged(complexity, with_linters(written(tmp_path, {"m/a.py": text}))).share == 1.0) is allowed
