"""`grader new-course` and `grader new requirement`: what they lay out works, and nothing of others is lost."""

from __future__ import annotations

from pathlib import Path

import pytest

from grader import KIT, building, cli, pipeline
from grader.authoring import check_course, held_back, new_course, new_requirement
from grader.errors import GraderError

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


def test_a_new_requirement_is_in_order_and_keeps_every_line_of_the_rubric(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    course = new_course.lay_out(tmp_path / "mine")
    before = course.rubric.read_text().splitlines()
    monkeypatch.chdir(tmp_path)
    assert cli.main(["new", "requirement", "B4", "--course", "mine"]) == 0
    assert capsys.readouterr().out.splitlines()[:4] == [
        "mine/trials/b4.py", "mine/checks/check_b4.py", "mine/known_bad/b4.yaml", "mine/rubric.yaml"
    ]  # fmt: skip
    after = course.rubric.read_text().splitlines()
    place = after.index("      - id: B4")
    assert after[:place] + after[place + 6 :] == before
    assert after[place + 6 : place + 8] == [
        "",
        "  # All these checks are stock: they read the contract, and need no line of yours.",
    ]
    assert check_course.mistakes(course.folder) == []
    criterion = check_course.read_rubric(course).criteria[0]
    assert [requirement.id for requirement in criterion.requirements] == ["B1", "B2", "B3", "B4"]
    typed = f"    points: {criterion.points:g}\n    requirements:"
    course.rubric.write_text(course.rubric.read_text().replace("    requirements:", typed, 1))
    new_requirement.add(course, "F15")
    assert check_course.read_rubric(course).criteria[0].points == criterion.points + 1


@pytest.mark.parametrize("criteria", ["[]", "\n  - id: first\n    requirements: []"])
def test_a_criterion_without_requirements_is_left_to_its_author(tmp_path: Path, criteria: str):
    course = new_course.lay_out(tmp_path / "mine")
    course.rubric.write_text(f"title: Mine\ncriteria: {criteria}\n")
    with pytest.raises(GraderError):
        new_requirement._inserted(course.rubric, "")


def test_what_judges_a_new_requirement_that_is_held_back_is_where_no_kit_takes_it_from(tmp_path: Path):
    course = new_course.lay_out(tmp_path / "mine")
    new_requirement.add(course, "B4")
    assert cli.main(["new", "requirement", "X1", "--held-back", "--course", str(course.folder)]) == 0
    assert files(course.held_back) == {"trials/x1.py", "checks/check_x1.py"}
    assert check_course.read_rubric(course).requirement("X1").held_back
    assert check_course.mistakes(course.folder) == []
    held_back.require_apart(course, {"checks/check_b4.py": (course.folder / "checks/check_b4.py").read_bytes()})


@pytest.mark.parametrize("name", ["B3", "on_and_off", "1X", "X 1"])
def test_an_id_that_is_taken_or_is_none_changes_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str):
    course = new_course.lay_out(tmp_path / "mine")
    before = files(course.folder), course.rubric.read_text()
    assert cli.main(["new", "requirement", name, "--course", str(course.folder)]) == 2
    assert name in capsys.readouterr().err
    assert (files(course.folder), course.rubric.read_text()) == before
