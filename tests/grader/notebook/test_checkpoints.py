"""Which file each notebook adds, and `start_at`, which lays the package out."""

from __future__ import annotations

from pathlib import Path

import pytest
from helpers.course import COURSE, PACKAGE, REFERENCE

from grader.authoring import checkpoint_texts
from grader.intake import course_marker
from grader.intake.submission import open_submission
from grader.notebook import checkpoints
from grader.notebook.workspace import Workspace


def test_no_notebook_both_asks_for_a_file_and_gives_it() -> None:
    for name in list(checkpoints.table()):
        files = checkpoints.checkpoint(name)
        assert not set(files.exercises) & set(files.given)


def test_a_checkpoint_holds_the_files_of_the_notebooks_so_far() -> None:
    files = checkpoints.files_after("05_moving_safely")
    assert f"{PACKAGE}/driver.py" in files
    assert f"{PACKAGE}/speed_server.py" not in files
    assert "class RobotController(Driver)" in files[f"{PACKAGE}/robot_controller.py"]
    assert sorted(checkpoints.writers_before("06")) == sorted(files)


def test_every_file_knows_the_notebook_that_writes_it_first() -> None:
    assert checkpoints.written_in("package.xml") == "01"
    assert checkpoints.written_in(f"{PACKAGE}/driver.py") == "05"
    assert checkpoints.written_in("test_results.xml") == "10"
    assert checkpoints.written_in("nothing.py") == ""


# -- in a students' kit -----------------------------------------------------------------------------------------------


@pytest.fixture
def student_kit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A kit without grader.authoring; its packed file is missing."""
    monkeypatch.setattr(checkpoints, "entry_points", lambda **_group: ())
    monkeypatch.setattr(checkpoints, "PACKED", tmp_path / "checkpoints.bin")


def test_packed_checkpoints_hold_the_same_texts(student_kit: None) -> None:
    checkpoints.PACKED.write_bytes(checkpoint_texts.pack())
    found = checkpoints.files_after("10")
    assert found["README.md"] == (REFERENCE / "README.md").read_text()
    assert len(found) == 42


def test_without_solutions_start_at_says_so_in_one_sentence(student_kit: None, workspace: Workspace) -> None:
    said = checkpoints.start_at(workspace, "05")
    assert said == "start_at('05'): this kit holds no solutions to lay out; your instructor has left them out."
    assert not workspace.package.exists()
    assert f"{PACKAGE}/driver.py" in checkpoints.writers_before("06"), "the course still knows its files"


# -- laying out -------------------------------------------------------------------------------------------------------


def test_start_at_lays_out_the_work_of_the_earlier_notebooks_and_keeps_the_earlier_content(
    workspace: Workspace,
) -> None:
    workspace.package.mkdir(parents=True)
    (workspace.package / "mine.txt").write_text("a week's work")
    said = checkpoints.start_at(workspace, "05")
    assert said == (
        "Your package now holds what the notebooks before 05 leave: 18 files, laid out by the course. "
        "Its earlier content is in ws/backup-1."
    )
    assert (workspace.package / PACKAGE / "sensor_processor.py").is_file()
    assert (workspace.package / "scripts" / "robot_controller").stat().st_mode & 0o111, "programs can be run"
    assert not (workspace.package / PACKAGE / "driver.py").exists()
    assert not (workspace.package / "mine.txt").exists()
    assert (workspace.root / "backup-1" / "mine.txt").read_text() == "a week's work"
    assert checkpoints.start_at(workspace, "00").endswith("Its earlier content is in ws/backup-2.")
    assert list(workspace.package.iterdir()) == []


def test_laid_out_exercises_are_noted_until_they_are_changed(workspace: Workspace) -> None:
    checkpoints.start_at(workspace, "04")
    package = workspace.package
    assert f"{PACKAGE}/utils/conversions.py" in course_marker.unchanged(package)
    assert f"{PACKAGE}/utils/running.py" not in course_marker.unchanged(package)  # given to everybody
    (package / PACKAGE / "utils" / "conversions.py").write_text("# mine\n")
    assert f"{PACKAGE}/utils/conversions.py" not in course_marker.unchanged(package)


def test_the_intake_notes_the_laid_out_files(workspace: Workspace, tmp_path: Path) -> None:
    checkpoints.start_at(workspace, "04")
    found = open_submission(workspace.package, tmp_path / "taken", COURSE)
    (note,) = [note for note in found.intake.notes if "laid out" in note]
    assert note.startswith("8 files were laid out by the course (start_at, or a lane)")
    assert note.endswith(
        "CMakeLists.txt, action/NavigateToPosition.action, msg/SensorFusionData.msg, package.xml, "
        f"{PACKAGE}/utils/conversions.py, scripts/robot_controller, srv/GetRobotStatus.srv, srv/SetSpeed.srv."
    )
