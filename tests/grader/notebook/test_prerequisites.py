"""The answer for a package that lacks what a requirement needs: what is missing and how to get it."""

from __future__ import annotations

from pathlib import Path

import pytest
from helpers.archives import write
from helpers.course import COURSE, PACKAGE

from grader.evidence import Build, Kind, Reason
from grader.intake import course_marker
from grader.notebook import checkpoints, prerequisites
from grader.notebook.workspace import course
from grader.scoring import rubric


def lay_out(folder: Path, notebook: str) -> Path:
    """Write the package as a notebook leaves it."""
    return write(folder, checkpoints.files_after(notebook))


def gap(package: Path, requirement: str, notebook: str = "") -> tuple[str, str]:
    found = prerequisites.first_gap(package, requirement, notebook)
    return (found.seen, found.try_) if found else ("", "")


def test_files_are_named_for_requirements_that_there_are() -> None:
    ids = {requirement.id for requirement in rubric.load(COURSE.rubric).requirements}
    assert set(course().notebook_table["needs"]) <= ids


@pytest.mark.parametrize("requirement", sorted(course().notebook_table["needs"]))
def test_nothing_is_missing_from_the_finished_package(tmp_path: Path, requirement: str) -> None:
    assert prerequisites.first_gap(lay_out(tmp_path, "10"), requirement) is None


CONTROLLER = f"{PACKAGE}/robot_controller.py"
LAY_OUT = 'notebook {} writes it; `start_at("{}")` lays out what the earlier notebooks leave'


@pytest.mark.parametrize(
    ("left_by", "edits", "requirement", "notebook", "seen", "try_"),
    [
        ("", {}, "F4", "05", "your package is empty", LAY_OUT.format("01", "05")),
        ("", {course_marker.MARKER: "{}"}, "I2", "", "your package is empty", ""),
        (
            "02", {"README.md": "# Mine"}, "F14", "03", f"there is no {PACKAGE}/utils/conversions.py",
            "write it in this notebook's exercise, and run that cell",
        ),
        ("07", {}, "T1", "07", "there is no test/test_robot_controller.py", "notebook 09 writes it"),
        (
            "07", {"test/test_robot_controler.py": ""}, "T1", "09", "there is no test/test_robot_controller.py",
            "did you mean test/test_robot_controler.py?",
        ),
        (
            "10", {CONTROLLER: "import math\ndef drive(:\n    pass\n"}, "F1", "",
            f"{CONTROLLER}, line 2: invalid syntax: `def drive(:`", "look at that line",
        ),
    ],
)  # fmt: skip
def test_the_first_thing_that_is_missing_is_named_with_what_to_do(
    tmp_path: Path, left_by: str, edits: dict[str, str], requirement: str, notebook: str, seen: str, try_: str
) -> None:
    if left_by:
        lay_out(tmp_path, left_by)
    found = gap(write(tmp_path, edits), requirement, notebook)
    assert found[0] == seen
    assert found[1].startswith(try_)


def test_a_folder_that_is_not_there_is_an_empty_package(tmp_path: Path) -> None:
    assert gap(tmp_path / "nowhere", "F4")[0] == "your package is empty"


@pytest.mark.parametrize(
    ("exit_code", "log", "reason"),
    [
        (1, "x\nCMake Error in 'package.xml'\n", "CMake Error in 'package.xml'"),
        (0, "Summary: 1 package finished\n", "does CMakeLists.txt end with ament_package()?"),
        (3, "hm\n", "`colcon build` ended with exit status 3"),
    ],
)
def test_the_reason_for_a_failed_build(exit_code: int, log: str, reason: str) -> None:
    found = Build(ok=False, cached=False, wall_seconds=1.0, exit_code=exit_code, timed_out=False, log_tail=log)
    assert prerequisites.first_error(found).endswith(reason)


@pytest.mark.parametrize(
    ("reason", "advice"),
    [
        (Reason(Kind.DEPENDS, requirements=("F2",)), 'fix F2 first: `check("F2")` says more'),
        (Reason(Kind.NO_PROGRAM, "robot_controller"), 'install it with install(PROGRAMS ...) in CMakeLists.txt'),
        (Reason(Kind.NO_SERVICE, "set_speed"), "complete the exercise that provides it"),
        (Reason(Kind.DIED, place="pkg/a.py:7, in `f`"), "its last output says where"),
        (Reason(Kind.DIED), "look at what the node does and prints"),
        (Reason(Kind.UNTRIED), "make the robot drive first"),
        (Reason(Kind.HANGS), "let a timer do the next step"),
        (Reason(Kind.NO_ANSWER, place="a.py:7"), "let a timer do the next step"),
        (Reason(Kind.NO_ANSWER), "look at what the node does and prints"),
        (Reason(Kind.NOT_UP, "x", launch="x_launch.py"), "start the file yourself"),
        (Reason(Kind.NO_FILE, "launch/x_launch.py"), "install(DIRECTORY launch config ...)"),
        (None, "look at what the node does and prints"),
    ],
)  # fmt: skip
def test_the_reason_why_a_check_could_not_be_judged_comes_with_advice(reason: Reason | None, advice: str) -> None:
    assert advice in prerequisites.advice(reason)


def test_whatever_waits_is_a_check_of_the_rubric() -> None:
    whole = rubric.load(rubric.RUBRIC)
    assert set(course().notebook_table["later"]) <= {check.id for check in whole.checks}
    for name, found in course().notebook_table["stand_ins"].items():
        assert whole.requirement(name)
        assert found["check"] in {check.id for check in whole.requirement(found["requirement"]).checks}


def test_a_check_waits_before_the_notebook_that_brings_what_it_needs_and_not_in_it_or_outside_of_notebooks() -> None:
    waiting = course().notebook_table["later"]
    assert waiting
    for check, row in waiting.items():
        assert prerequisites.later(check, "00") == row
        assert prerequisites.later(check, row["notebook"]) is None
        assert prerequisites.later(check, "") is None
    assert prerequisites.stand_in("F6", "") is None
