"""`grader submit`: what goes into the archive, and what it says about it."""

from __future__ import annotations

import hashlib
import json
import shutil
import zipfile
from pathlib import Path

import pytest

from grader import cli
from grader.authoring.checkpoint_texts import REFERENCE
from grader.contract.spec import PACKAGE
from grader.errors import SubmissionError
from grader.intake import course_marker
from grader.notebook import packing


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """A student's package in a workspace: the reference's files, all their own work."""
    return Path(shutil.copytree(REFERENCE, tmp_path / "ws" / "src" / PACKAGE))


def packed(archive: Path) -> list[str]:
    with zipfile.ZipFile(archive) as opened:
        return opened.namelist()


def test_the_archive_holds_the_package_below_one_folder(package: Path):
    handed_in = packing.submit(package, check=False)
    assert handed_in.archive == package.parent.parent / "ros2_robot_controller.zip"
    assert {name.split("/")[0] for name in packed(handed_in.archive)} == {"ros2_robot_controller"}
    assert "ros2_robot_controller/package.xml" in packed(handed_in.archive)
    assert handed_in.missing == ()
    assert handed_in.laid_out == ()


def test_the_same_package_gives_the_same_bytes(package: Path, tmp_path: Path):
    first, second = (packing.submit(package, tmp_path / name, check=False).archive for name in ("a.zip", "b.zip"))
    assert first.read_bytes() == second.read_bytes()


def test_what_tools_made_is_left_out_and_a_folder_of_ones_own_stays(package: Path):
    made = (
        "build/COLCON_IGNORE",
        "build/x.o",
        "a/__pycache__/m.pyc",
        ".git/HEAD",
        ".pytest_cache/x",
        "venv/pyvenv.cfg",
    )
    for name in (*made, "old.zip", "log/notes.md"):
        (package / name).parent.mkdir(parents=True, exist_ok=True)
        (package / name).write_text("x")
    (package / "link").symlink_to(package / "package.xml")
    before = set(packing.submit(package, check=False).sizes)
    assert not before & {*made, "old.zip", "link"}
    assert "log/notes.md" in before


def test_an_executable_stays_one(package: Path):
    archive = packing.submit(package, check=False).archive
    with zipfile.ZipFile(archive) as opened:
        modes = {i.filename.split("/", 1)[1]: i.external_attr >> 16 & 0o111 for i in opened.infolist()}
    assert modes["scripts/robot_controller"]
    assert not modes["package.xml"]


def test_files_that_the_course_laid_out_are_named(package: Path):
    sums = {name: hashlib.sha256((package / name).read_bytes()).hexdigest() for name in ("package.xml", "setup.py")}
    (package / course_marker.MARKER).write_text(json.dumps({"laid_out_before": "05", "sha256": sums}))
    (package / "setup.py").write_text("# mine now\n")
    handed_in = packing.submit(package, check=False)
    assert handed_in.laid_out == ("package.xml",)
    assert "package.xml   laid out by the course" in str(handed_in)
    assert "1 of " in str(handed_in)


def test_a_damaged_marker_counts_for_nothing(package: Path):
    (package / course_marker.MARKER).write_text('{"sha256": [1]}')
    assert packing.submit(package, check=False).laid_out == ()


def test_split_interfaces_go_along(package: Path):
    other = package.with_name("ros2_robot_controller_interfaces")
    other.mkdir()
    (other / "package.xml").write_text((package / "package.xml").read_text().replace(package.name, other.name))
    assert "ros2_robot_controller_interfaces/package.xml" in packed(packing.submit(package, check=False).archive)


def test_what_is_missing_is_said(package: Path):
    (package / "ros2_robot_controller" / "sensor_processor.py").unlink()
    assert "missing: ros2_robot_controller/sensor_processor.py" in str(packing.submit(package, check=False))


def test_without_a_package_one_sentence_says_so(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    assert cli.main(["submit", "--package", str(tmp_path)]) == 1
    assert "There is nothing to hand in" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_a_package_that_is_too_large_is_told_by_its_largest_file(package: Path):
    with (package / "drive.bag").open("wb") as file:
        file.truncate(60_000_000)
    with pytest.raises(SubmissionError, match=r"The largest is drive\.bag with 60\.0 MB"):
        packing.submit(package, check=False)


def test_the_command_says_where_the_archive_lies(
    package: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.chdir(package)
    assert cli.main(["submit", "--no-check"]) == 0
    said = capsys.readouterr().out
    assert "Nothing was checked." in said
    assert said.endswith("Hand in: ../../ros2_robot_controller.zip\n")


@pytest.mark.slow
@pytest.mark.ros
@pytest.mark.sandbox
def test_the_public_checks_run_on_the_archive(package: Path):
    handed_in = packing.submit(package)
    assert "Together               100 of 100" in str(handed_in)
