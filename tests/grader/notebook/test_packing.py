"""`grader submit`: the content of the archive, and its description."""

from __future__ import annotations

import hashlib
import json
import shutil
import zipfile
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest
from helpers.archives import write
from helpers.course import PACKAGE, REFERENCE

from grader import cli
from grader.errors import SubmissionError
from grader.intake import course_marker
from grader.notebook import lanes, packing
from grader.notebook.workspace import Workspace
from grader.scoring import rubric
from grader.scoring.scorecard import Outcome, RequirementScore


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """A student's package in a workspace: the reference's files, all their own work."""
    return Path(shutil.copytree(REFERENCE, tmp_path / "ws" / "src" / PACKAGE))


def packed(archive: Path) -> list[str]:
    with zipfile.ZipFile(archive) as opened:
        return opened.namelist()


def test_the_archive_holds_the_package_below_one_folder_and_is_the_same_each_time(package: Path, tmp_path: Path):
    submission = packing.submit(package, check=False)
    assert submission.archive == package.parent.parent / "ros2_robot_controller.zip"
    assert {name.split("/")[0] for name in packed(submission.archive)} == {"ros2_robot_controller"}
    assert "ros2_robot_controller/package.xml" in packed(submission.archive)
    assert (submission.missing, submission.laid_out) == ((), ())
    again = packing.submit(package, tmp_path / "again.zip", check=False).archive
    assert again.read_bytes() == submission.archive.read_bytes()
    with zipfile.ZipFile(again) as opened:
        modes = {i.filename.split("/", 1)[1]: i.external_attr >> 16 & 0o111 for i in opened.infolist()}
    assert modes["scripts/robot_controller"], "executables stay executable"
    assert not modes["package.xml"]


def test_generated_files_are_left_out_and_a_students_own_log_stays(package: Path):
    made = (
        "build/COLCON_IGNORE",
        "build/x.o",
        "a/__pycache__/m.pyc",
        ".git/HEAD",
        ".pytest_cache/x",
        "venv/pyvenv.cfg",
    )
    write(package, dict.fromkeys((*made, "old.zip", "log/notes.md"), "x"))
    (package / "link").symlink_to(package / "package.xml")
    before = set(packing.submit(package, check=False).sizes)
    assert not before & {*made, "old.zip", "link"}
    assert "log/notes.md" in before


def test_files_laid_out_by_the_course_are_named(package: Path):
    sums = {name: hashlib.sha256((package / name).read_bytes()).hexdigest() for name in ("package.xml", "setup.py")}
    (package / course_marker.MARKER).write_text(json.dumps({"sha256": sums}))
    (package / "setup.py").write_text("# mine now\n")
    submission = packing.submit(package, check=False)
    assert submission.laid_out == ("package.xml",)
    assert f"{PACKAGE}/{course_marker.MARKER}" in packed(submission.archive)
    assert "package.xml   laid out by the course" in str(submission)
    assert "1 of " in str(submission)
    (package / course_marker.MARKER).write_text('{"sha256": [1]}')
    assert packing.submit(package, check=False).laid_out == (), "a damaged marker is ignored"


def test_a_separate_interfaces_package_is_packed_too(package: Path):
    other = package.with_name("ros2_robot_controller_interfaces")
    other.mkdir()
    (other / "package.xml").write_text((package / "package.xml").read_text().replace(package.name, other.name))
    assert "ros2_robot_controller_interfaces/package.xml" in packed(packing.submit(package, check=False).archive)


def test_a_missing_file_is_named(package: Path):
    (package / "ros2_robot_controller" / "sensor_processor.py").unlink()
    assert "missing: ros2_robot_controller/sensor_processor.py" in str(packing.submit(package, check=False))


def test_without_a_package_one_sentence_says_so(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    assert cli.main(["submit", "--package", str(tmp_path)]) == 1
    assert "There is nothing to hand in" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_the_error_for_a_package_that_is_too_large_names_its_largest_file(package: Path):
    with (package / "drive.bag").open("wb") as file:
        file.truncate(60_000_000)
    with pytest.raises(SubmissionError, match=r"The largest files are drive\.bag \(57 MB\)"):
        packing.submit(package, check=False)


def test_the_command_prints_the_path_of_the_archive(
    package: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.chdir(package)
    assert cli.main(["submit", "--no-check"]) == 0
    said = capsys.readouterr().out
    assert "Nothing was checked." in said
    assert said.endswith("Hand in: ../../ros2_robot_controller.zip\n")


@pytest.mark.slow  # a whole grading
@pytest.mark.ros
@pytest.mark.sandbox
def test_the_public_checks_run_on_the_archive(package: Path):
    submission = packing.submit(package)
    assert "Together               100 of 100" in str(submission)


@pytest.mark.parametrize(("lane", "said"), [("core", "Your lane, core, asks for 85 of these points"), ("whole", "")])
def test_the_points_of_a_shorter_lane_are_said(lane: str, said: str, package: Path):
    (package.parents[1].parent / "notebooks").mkdir()
    lanes.keep(Workspace(package.parents[1]), lane)
    graded = packing.submit(package, check=False)
    judged = [
        RequirementScore(r, r.points, r.points, Outcome.PASSED, ()) for r in rubric.load(rubric.RUBRIC).requirements
    ]
    card = SimpleNamespace(criteria=[], requirements=judged)
    lines = str(replace(graded, grading=SimpleNamespace(scorecard=card)))  # type: ignore[arg-type]
    assert ("Your lane" in lines) == bool(said)
    assert said in lines
    assert "and you have 85." in lines or not said
