"""The stages: each notebook adds files, the last one leaves the reference, and the solutions live once."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from grader import build
from grader.authoring import starter_files
from grader.authoring.reference_edits import Edit
from grader.errors import GraderError
from grader.host import ros_env
from grader.intake import course_marker
from grader.intake.submission import open_submission
from grader.notebook import checkpoints
from grader.notebook.checkpoints import NOTEBOOKS, REFERENCE
from grader.notebook.workspace import PACKAGE, Workspace

NUMBERS = [name[:2] for name in NOTEBOOKS]


def reference_files() -> set[str]:
    return {
        str(path.relative_to(REFERENCE))
        for path in REFERENCE.rglob("*")
        if path.is_file() and not path.name.startswith(".") and not {"__pycache__", ".pytest_cache"} & set(path.parts)
    }


def finals() -> list[str]:
    """The paths that the course has in the reference's own version, one for each time it is written."""
    found = []
    for key in NUMBERS:
        stage = checkpoints.stage(key)
        for versions in (stage.exercises, stage.given, stage.made):
            found += [path for path, version in versions.items() if version.final]
    return found


def test_each_file_of_the_reference_is_written_once_in_its_final_version() -> None:
    assert sorted(finals()) == sorted(reference_files())


def test_the_last_notebook_leaves_the_reference() -> None:
    files = checkpoints.files_after("10")
    assert set(files) == reference_files()
    assert all(text == (REFERENCE / path).read_text() for path, text in files.items())


def test_no_notebook_both_asks_for_a_file_and_gives_it() -> None:
    for key in NUMBERS:
        stage = checkpoints.stage(key)
        assert not set(stage.exercises) & set(stage.given)


def test_a_stage_holds_what_the_notebooks_so_far_have_written() -> None:
    files = checkpoints.files_after("05_moving_safely")
    assert f"{PACKAGE}/driver.py" in files
    assert f"{PACKAGE}/speed_server.py" not in files
    assert "class RobotController(Driver)" in files[f"{PACKAGE}/robot_controller.py"]
    assert checkpoints.paths_before("06") == sorted(files, key=checkpoints.paths_before("06").index)


def test_the_first_package_has_no_interfaces_and_the_second_has() -> None:
    assert "rosidl" not in checkpoints.exercise("01", "CMakeLists.txt")
    assert "rosidl" not in checkpoints.exercise("01", "package.xml")
    assert checkpoints.exercise("02", "CMakeLists.txt") == (REFERENCE / "CMakeLists.txt").read_text()


def test_an_edit_that_no_longer_fits_the_reference_says_so() -> None:
    edit = Edit("no interfaces yet", "find_package(nothing)", "")
    with pytest.raises(GraderError, match=r"'no interfaces yet' fits the reference 0 times, not once"):
        edit.apply("find_package(rclpy)")


def test_an_unknown_notebook_is_named_with_those_there_are() -> None:
    with pytest.raises(ValueError, match=r"no notebook '11'; there are 00_first_drive, 01_anatomy"):
        checkpoints.stage("11")


def test_every_file_knows_the_notebook_that_writes_it_first() -> None:
    assert checkpoints.written_in("package.xml") == "01"
    assert checkpoints.written_in(f"{PACKAGE}/driver.py") == "05"
    assert checkpoints.written_in("test_results.xml") == "10"
    assert checkpoints.written_in("nothing.py") == ""


def test_given_texts_keep_to_ninety_nine_columns_and_end_in_a_line_break() -> None:
    texts = [text for name, text in vars(starter_files).items() if name.isupper()]
    assert len(texts) == 7
    for text in texts:
        assert text.endswith("\n")
        assert not text.endswith("\n\n")
        assert max(map(len, text.splitlines())) <= 99
        compile(text, "given", "exec")


# -- without the reference --------------------------------------------------------------------------------------------


@pytest.fixture
def student_kit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A kit without solution_pkg; return where a packed file would lie."""
    packed = checkpoints.pack()
    monkeypatch.setattr(checkpoints, "REFERENCE", tmp_path / "absent")
    monkeypatch.setattr(checkpoints, "PACKED", tmp_path / "stages.bin")
    checkpoints._packed.cache_clear()
    (tmp_path / "kept.bin").write_bytes(packed)
    return tmp_path


def test_packed_stages_hold_the_same_texts(student_kit: Path) -> None:
    (student_kit / "kept.bin").rename(checkpoints.PACKED)
    found = checkpoints.files_after("10")
    assert found["README.md"].startswith("# ")
    assert checkpoints.exercise("05", f"{PACKAGE}/driver.py") == found[f"{PACKAGE}/driver.py"]
    assert "test/test_motion.py" in checkpoints.stage("09").exercises


def test_without_solutions_start_at_says_so_in_one_sentence(student_kit: Path, workspace: Workspace) -> None:
    said = checkpoints.start_at(workspace, "05")
    assert said == "start_at('05'): this kit holds no solutions to lay out; your instructor has left them out."
    assert not workspace.package.exists()


def test_without_solutions_the_course_still_knows_its_files(student_kit: Path) -> None:
    assert f"{PACKAGE}/driver.py" in checkpoints.paths_before("06")
    assert checkpoints.written_in("README.md") == "10"


# -- laying out -------------------------------------------------------------------------------------------------------


def test_start_at_lays_out_what_the_earlier_notebooks_leave(workspace: Workspace) -> None:
    said = checkpoints.start_at(workspace, "05")
    assert (workspace.package / PACKAGE / "sensor_processor.py").is_file()
    assert not (workspace.package / PACKAGE / "driver.py").exists()
    assert said == "Your package holds now what the notebooks before 05 leave: 18 files, laid out by the course."


def test_start_at_keeps_what_was_there(workspace: Workspace) -> None:
    workspace.package.mkdir(parents=True)
    (workspace.package / "mine.txt").write_text("a week's work")
    said = checkpoints.start_at(workspace, "02")
    assert (workspace.root / "backup-1" / "mine.txt").read_text() == "a week's work"
    assert not (workspace.package / "mine.txt").exists()
    assert said.endswith("What was there is in ws/backup-1.")
    assert checkpoints.start_at(workspace, "03").endswith("What was there is in ws/backup-2.")


def test_start_at_the_first_notebook_leaves_an_empty_package(workspace: Workspace) -> None:
    checkpoints.start_at(workspace, "03")
    checkpoints.start_at(workspace, "00")
    assert list(workspace.package.iterdir()) == []


def test_executables_can_be_executed(workspace: Workspace) -> None:
    checkpoints.start_at(workspace, "02")
    assert (workspace.package / "scripts" / "robot_controller").stat().st_mode & 0o111


def test_laid_out_exercises_are_noted_until_they_are_changed(workspace: Workspace) -> None:
    checkpoints.start_at(workspace, "04")
    package = workspace.package
    assert f"{PACKAGE}/utils/conversions.py" in course_marker.unchanged(package)
    assert f"{PACKAGE}/utils/running.py" not in course_marker.unchanged(package)  # given to everybody
    (package / PACKAGE / "utils" / "conversions.py").write_text("# mine\n")
    assert f"{PACKAGE}/utils/conversions.py" not in course_marker.unchanged(package)


@pytest.mark.parametrize("marker", ["", "[]", "{", '{"sha256": []}', '{"sha256": {"package.xml": 3}}', "null"])
def test_a_marker_that_is_none_is_let_alone(tmp_path: Path, marker: str) -> None:
    (tmp_path / checkpoints.MARKER).write_text(marker)
    assert course_marker.note(tmp_path) == ""


def test_a_marker_cannot_point_outside_the_package(tmp_path: Path) -> None:
    package = tmp_path / "package"
    package.mkdir()
    (tmp_path / "secret").write_text("x")
    sums = dict.fromkeys(("../secret", str(tmp_path / "secret")), checkpoints.sha256(b"x"))
    (package / checkpoints.MARKER).write_text(json.dumps({"sha256": sums}))
    assert course_marker.unchanged(package) == []


def test_the_intake_notes_what_was_laid_out(workspace: Workspace, tmp_path: Path) -> None:
    checkpoints.start_at(workspace, "04")
    found = open_submission(workspace.package, tmp_path / "taken")
    assert [note for note in found.intake.notes if "laid out" in note] == [
        "8 files were laid out by the course (start_at) and not changed since, so not the student's own work: "
        "CMakeLists.txt, action/NavigateToPosition.action, msg/SensorFusionData.msg, package.xml, "
        f"{PACKAGE}/utils/conversions.py, scripts/robot_controller, srv/GetRobotStatus.srv, srv/SetSpeed.srv."
    ]


def test_the_intake_of_a_package_without_a_marker_notes_nothing(tmp_path: Path) -> None:
    assert open_submission(REFERENCE, tmp_path / "taken").intake.notes == []


# -- building ---------------------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.sandbox
@pytest.mark.parametrize("notebook", NUMBERS[1:])
def test_every_stage_builds_and_installs_both_nodes(workspace: Workspace, notebook: str) -> None:
    package = workspace.package
    for path, text in checkpoints.files_after(notebook).items():
        (package / path).parent.mkdir(parents=True, exist_ok=True)
        (package / path).write_text(text)
    built = build.build([package], build.cache_folder())
    assert built.facts.ok, built.facts.log_tail
    assert {"robot_controller", "sensor_processor"} <= set(built.facts.executables)
    modules = built.install / ros_env.SITE_IN_PREFIX / PACKAGE
    assert (modules / "robot_controller.py").is_file()
