"""The answer for a package that lacks what a requirement needs: what is missing and how to get it."""

from __future__ import annotations

from pathlib import Path

import pytest
from helpers.course import COURSE, PACKAGE

from grader.evidence import Build, Kind, Reason
from grader.intake import course_marker
from grader.notebook import checkpoints, prerequisites
from grader.notebook.workspace import course
from grader.scoring import rubric


def lay_out(folder: Path, notebook: str) -> Path:
    """Write the package as a notebook leaves it."""
    for path, text in checkpoints.files_after(notebook).items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_text(text)
    return folder


def gap(package: Path, requirement: str, notebook: str = "") -> tuple[str, str]:
    found = prerequisites.first_gap(package, requirement, notebook)
    return (found.seen, found.try_) if found else ("", "")


def test_files_are_named_for_requirements_that_there_are() -> None:
    ids = {requirement.id for requirement in rubric.load(COURSE.rubric).requirements}
    assert set(course().notebook_table["needs"]) <= ids


@pytest.mark.parametrize("requirement", sorted(course().notebook_table["needs"]))
def test_nothing_is_missing_from_the_finished_package(tmp_path: Path, requirement: str) -> None:
    assert prerequisites.first_gap(lay_out(tmp_path, "10"), requirement) is None


def test_an_empty_package_names_the_first_notebook(tmp_path: Path) -> None:
    seen, try_ = gap(tmp_path, "F4", "05")
    assert seen == "your package is empty"
    assert try_ == 'notebook 01 writes it; `start_at("05")` lays out what the earlier notebooks leave'
    assert gap(tmp_path / "nowhere", "F4")[0] == "your package is empty"


def test_a_package_with_only_the_courses_marker_counts_as_empty(tmp_path: Path) -> None:
    (tmp_path / course_marker.MARKER).write_text("{}")
    assert gap(tmp_path, "I2")[0] == "your package is empty"


def test_a_missing_file_of_this_notebook_is_asked_for_here(tmp_path: Path) -> None:
    (lay_out(tmp_path, "02") / "README.md").write_text("# Mine")
    assert gap(tmp_path, "F14", "03") == (
        f"there is no {PACKAGE}/utils/conversions.py", "write it in this notebook's exercise, and run that cell"
    )  # fmt: skip


def test_a_missing_file_of_a_later_notebook_names_that_notebook(tmp_path: Path) -> None:
    assert gap(lay_out(tmp_path, "07"), "T1", "07")[1] == "notebook 09 writes it"


def test_a_syntax_error_is_shown_with_its_line(tmp_path: Path) -> None:
    (lay_out(tmp_path, "10") / PACKAGE / "driver.py").write_text("import math\ndef drive(:\n    pass\n")
    seen, try_ = gap(tmp_path, "F1")
    assert seen == f"{PACKAGE}/driver.py, line 2: invalid syntax: `def drive(:`"
    assert "that line" in try_


def test_a_module_that_is_imported_and_missing_is_named_with_its_notebook(tmp_path: Path) -> None:
    (lay_out(tmp_path, "06") / PACKAGE / "driver.py").unlink()
    seen, try_ = gap(tmp_path, "F1", "06")
    assert seen == f"{PACKAGE}/speed_server.py imports {PACKAGE}.driver, and there is no {PACKAGE}/driver.py"
    assert try_.startswith("notebook 05 writes it")


def test_a_misspelt_import_is_asked_about(tmp_path: Path) -> None:
    """It said "there is no navigater.py" and "write it"."""
    path = lay_out(tmp_path, "08") / PACKAGE / "robot_controller.py"
    path.write_text(path.read_text().replace("navigator", "navigater"))
    seen, try_ = gap(tmp_path, "F1", "07")
    assert seen.endswith(f"there is no {PACKAGE}/navigater.py")
    assert try_ == f"did you mean {PACKAGE}/navigator.py?"


def test_generated_interfaces_and_relative_imports_are_not_missing_modules(tmp_path: Path) -> None:
    lay_out(tmp_path, "10")
    (tmp_path / PACKAGE / "robot_controller.py").write_text(
        f"from . import driver\nimport {PACKAGE}.srv\nfrom {PACKAGE}.msg import SensorFusionData\nimport rclpy.node\n"
    )
    assert prerequisites.first_gap(tmp_path, "F1") is None


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
        assert prerequisites.later(check, "00") == prerequisites.Later(**row)
        assert prerequisites.later(check, row["notebook"]) is None
        assert prerequisites.later(check, "") is None
    assert prerequisites.stand_in("F6", "") is None
