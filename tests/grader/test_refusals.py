"""What `grader grade` does where there is nothing to grade, and with reports that are there already. Builds nothing."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from helpers.archives import NODE, PACKAGE, below, write, zipped
from helpers.course import COURSE

from grader import KIT, cli, pipeline

pytestmark = pytest.mark.sandbox  # which must be there before anything is taken in


class Collected(BaseException):
    """The grading was allowed to go on, to the build."""


@pytest.fixture(autouse=True)
def builds_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    def collect(*_: object) -> None:
        raise Collected

    monkeypatch.setattr(pipeline, "collect", collect)


def grade(*arguments: object) -> int:
    return cli.main(["grade", *map(str, arguments)])


def read(out: Path) -> dict:
    return json.loads((out / "report.json").read_text())


@pytest.fixture
def out(tmp_path: Path) -> Path:
    return tmp_path / "out"


@pytest.fixture
def documents(tmp_path: Path) -> Path:
    """A submission that cannot be graded."""
    return zipped(tmp_path / "team07.zip", {"README.md": "My robot"})


def test_a_refusal_writes_both_reports(documents: Path, out: Path, capsys: pytest.CaptureFixture[str]):
    assert grade(documents, "--out", out) == 1
    printed = capsys.readouterr()
    assert printed.err.endswith(
        "grader: team07.zip contains no package.xml. "
        "Zip the package folder itself (the one with package.xml and setup.py) and submit again.\n"
    )
    assert printed.out == f"Report: {out / 'report.html'}\n"
    assert read(out)["refused"] == {
        "because": "team07.zip contains no package.xml.",
        "try": "Zip the package folder itself (the one with package.xml and setup.py) and submit again.",
    }
    assert "contains no package.xml" in (out / "report.html").read_text()


def test_a_refusal_replaces_the_evidence_of_an_earlier_grading(documents: Path, out: Path):
    write(out, {"evidence/build.json": "{}"})
    assert grade(documents, "--out", out) == 1
    assert list((out / "evidence").iterdir()) == []


def test_what_was_left_out_and_not_opened_is_in_a_refusal(
    tmp_path: Path, out: Path, capsys: pytest.CaptureFixture[str]
):
    zipped(write(tmp_path / "in", {"a.zip": "no zip", "b.rar": "Rar!"}) / "c.zip", {"../x.md": ""})
    assert grade(tmp_path / "in", "--out", out) == 1
    printed, page = capsys.readouterr().err, (out / "report.html").read_text()
    for words in ("a.zip was not opened", "b.rar was not opened", "Opened c.zip inside.", "x.md: its path leads out"):
        (note,) = [note for note in read(out)["notes"] if words in note]
        assert f"note: {note}\n" in printed
        assert words in page


def test_a_missing_submission_leaves_the_reports_alone(tmp_path: Path, documents: Path, out: Path):
    grade(documents, "--out", out)
    before = (out / "report.json").read_text()
    assert grade(tmp_path / "tema07.zip", "--out", out) == 1
    assert (out / "report.json").read_text() == before


@pytest.mark.parametrize("more", [{}, {"msg/A.msg": ""}, {"launch/a_launch.py": ""}])
def test_an_early_state_of_the_package_is_graded(tmp_path: Path, out: Path, more: dict[str, str]):
    """The course begins with package.xml and interfaces, and `check` grades at every step."""
    write(tmp_path / "in", {"package.xml": PACKAGE["package.xml"], **more})
    with pytest.raises(Collected):
        grade(tmp_path / "in", "--out", out)


# -- reports that are there -----------------------------------------------------------------------------------------


def test_another_submissions_report_stays(
    tmp_path: Path, documents: Path, out: Path, capsys: pytest.CaptureFixture[str]
):
    grade(documents, "--out", out)
    before = (out / "report.json").read_text()
    other = zipped(tmp_path / "team08.zip", PACKAGE)
    assert grade(other, "--out", out) == 2
    assert (
        f"grader: {out} has the report of team07.zip; nothing was written. "
        "Choose another --out, or replace it with --force." in capsys.readouterr().err
    )
    assert (out / "report.json").read_text() == before
    with pytest.raises(Collected):
        grade(other, "--out", out, "--force")


def test_another_submission_of_the_same_name_is_another_submission(tmp_path: Path, out: Path):
    """Every student's folder has the name that the assignment asks for."""
    alice = write(tmp_path / "alice/ros2_robot_controller", {"README.md": "x"})
    bob = write(tmp_path / "bob/ros2_robot_controller", {"README.md": "y"})
    assert grade(alice, "--out", out) == 1
    assert grade(bob, "--out", out) == 2


def test_a_submission_can_be_graded_again(documents: Path, out: Path):
    assert grade(documents, "--out", out) == 1
    zipped(documents, PACKAGE)
    with pytest.raises(Collected):
        grade(documents, "--out", out)


def test_the_same_content_from_another_place_is_the_same_submission(tmp_path: Path, out: Path):
    write(tmp_path / "a", PACKAGE)
    zipped(tmp_path / "b.zip", PACKAGE)
    taken = pipeline.open_submission(tmp_path / "a", tmp_path / "taken", COURSE).intake
    data = {"schema": "ros2-course-kit/report/1", "submission": "a", "sha256": taken.sha256, "source": "elsewhere"}
    write(out, {"report.json": json.dumps(data)})
    with pytest.raises(Collected):
        grade(tmp_path / "b.zip", "--out", out)


@pytest.mark.parametrize("text", ["", "[]", '{"a": 1}', "\x00"])
def test_a_report_json_of_something_else_stays(documents: Path, out: Path, text: str):
    write(out, {"report.json": text})
    assert grade(documents, "--out", out) == 2
    assert (out / "report.json").read_text() == text


@pytest.mark.parametrize("place", ["file/out", "file"])
def test_an_out_that_cannot_be_written_is_told_before_anything_is_built(
    tmp_path: Path, place: str, capsys: pytest.CaptureFixture[str]
):
    (tmp_path / "file").touch()
    assert grade(write(tmp_path / "in", PACKAGE), "--out", tmp_path / place) == 2
    error = capsys.readouterr().err
    assert f"grader: Cannot write to {tmp_path / place}: " in error
    assert error.endswith("Choose another --out.\n")


def test_an_out_inside_the_submission_is_no_part_of_it(tmp_path: Path):
    package = write(tmp_path / "pkg", PACKAGE)
    write(package / "out", {"evidence/a.json": ""})
    with pytest.raises(Collected):
        grade(package, "--out", package / "out")


# -- several --------------------------------------------------------------------------------------------------------

CHANGED = {**PACKAGE, "README.md": "another"}


def test_a_path_that_does_not_exist_is_wrong_usage_and_writes_nothing(
    tmp_path: Path, out: Path, capsys: pytest.CaptureFixture[str]
):
    source = zipped(tmp_path / "a.zip", {**below("v1/"), **below("v2/", CHANGED)})
    assert grade(source, "--out", out, "--package-path", "v3") == 2
    assert "There is no package at v3 in a.zip. It has packages at v1, v2." in capsys.readouterr().err
    assert not out.exists()
    with pytest.raises(Collected):
        grade(source, "--out", out, "--package-path", "v2")


def test_a_class_is_not_graded_as_its_first_student(tmp_path: Path, out: Path):
    course = write(tmp_path / "class", {"carol/README.md": "mine"})
    zipped(course / "alice.zip", PACKAGE)
    zipped(course / "bob.zip", CHANGED)
    zipped(course / "carol" / "v2.zip", {**PACKAGE, "src/x.py": NODE})
    assert grade(course, "--out", out) == 1
    assert read(out)["refused"]["because"].startswith("class holds 3 packages, and nothing tells which is meant: ")
    assert "grader batch" in read(out)["refused"]["try"]


def test_a_check_that_there_is_not_is_named_before_anything_runs(documents: Path, out: Path, tmp_path: Path, capsys):
    rubric = tmp_path / "rubric.yaml"
    rubric.write_text((KIT / "rubric.yaml").read_text().replace("without_a_command", "without_command"))
    assert grade(documents, "--rubric", rubric, "--out", out) == 3
    said = capsys.readouterr().err
    assert "check_idle::test_publishes_zero_without_command is not a check of the kit." in said
    assert "Did you mean check_idle::test_publishes_zero_without_a_command?" in said
    assert not out.exists()
