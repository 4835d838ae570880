"""`grader new-course`: what it lays out works, and nothing of others is lost."""

from __future__ import annotations

from pathlib import Path

import pytest

from grader import KIT, building, cli, pipeline
from grader.authoring import check_course, new_course
from grader.host import provenance

TEMPLATE = KIT / "grader" / "authoring" / "template_course"


def files(folder: Path) -> set[str]:
    found = {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}
    return {name for name in found if "__pycache__" not in name and ".pytest_cache" not in name}


def test_a_new_course_is_a_copy_of_the_small_one(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    assert cli.main(["new-course", str(tmp_path / "mine")]) == 0
    said = capsys.readouterr().out
    assert f"grader check-course {tmp_path / 'mine'}" in said
    assert "there, type --course . instead." in said
    assert files(tmp_path / "mine") == files(TEMPLATE)
    assert check_course.mistakes(tmp_path / "mine") == []


def test_another_name_of_the_package_is_everywhere(tmp_path: Path):
    course = new_course.lay_out(tmp_path / "mine", "zebra_walk")
    assert course.package == "zebra_walk"
    assert files(course.folder) == {name.replace("hall_guard", "zebra_walk") for name in files(TEMPLATE)}
    assert not [path for path in course.folder.rglob("*") if path.is_file() and "hall_guard" in path.read_text()]
    assert check_course.mistakes(course.folder) == []


@pytest.mark.slow  # a build
@pytest.mark.ros
@pytest.mark.sandbox
def test_under_another_name_the_solution_keeps_its_points_for_its_text_and_its_build(tmp_path: Path):
    """Imports were in the order of the old name, which ament_flake8 refuses."""
    course = new_course.lay_out(tmp_path / "mine", "zebra_walk")
    asked = ("P1", "P6")
    settings = pipeline.Settings(check_course.read_rubric(course), building.cache_folder(), course, requirements=asked)
    scores = pipeline.grade(course.solution, tmp_path / "out", settings).scorecard.requirements
    assert {score.requirement.id: score.lost for score in scores if score.requirement.id in asked} == {
        "P1": (),
        "P6": (),
    }


def test_a_folder_with_something_in_it_is_left_alone(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    (tmp_path / "notes.txt").write_text("mine")
    assert cli.main(["new-course", str(tmp_path)]) == 2
    assert "is not an empty folder; nothing was written." in capsys.readouterr().err
    assert files(tmp_path) == {"notes.txt"}


@pytest.mark.parametrize(
    ("name", "why"),
    [("Guard", "small letters"), ("a__b", "small letters"), ("class", "small letters"), ("rclpy", "Python module")],
)
def test_a_package_cannot_have_such_a_name(tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str, why: str):
    assert cli.main(["new-course", str(tmp_path / "mine"), "--package", name]) == 2
    assert why in capsys.readouterr().err
    assert not (tmp_path / "mine").exists()


def test_what_a_hunt_makes_up_decides_the_evidence_and_not_what_is_made_of_it(tmp_path: Path):
    folder = new_course.lay_out(tmp_path / "mine").folder
    before = provenance.kit_hash(folder), provenance.checks_hash(folder)
    (folder / "hunts").mkdir()
    (folder / "hunts" / "more.py").write_text("LIMIT = 1\n")
    assert provenance.kit_hash(folder) != before[0]
    assert provenance.checks_hash(folder) == before[1]
