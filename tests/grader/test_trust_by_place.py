"""Nothing is trusted for where it lies: no course, configuration or module comes from the current folder."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from helpers.archives import write

from grader import KIT, cli, notebook
from grader.authoring import course_command
from grader.course import find, kits_own
from grader.course.reader import VARIABLE
from grader.host import provenance
from grader.intake.submission import open_submission
from grader.notebook.workspace import VARIABLE as WORKSPACE
from grader.processes import supervised

RUNS = "open(__file__ + '.ran', 'w').close()\n"


@pytest.fixture
def inside(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A submission that brings a course, with the user in it."""
    monkeypatch.delenv(VARIABLE, raising=False)
    folder = tmp_path / "ros2_robot_controller"
    brings = {
        "package.xml": "<package format='3'><name>ros2_robot_controller</name></package>",
        "README.md": "# Nothing\n",
        "course.yaml": "title: Mine\npackage: ros2_robot_controller\nrubric: rubric.yaml\n",
        "rubric.yaml": "title: Mine\n",
        "checks/check_readme.py": RUNS,
        "trials/idle.py": RUNS,
    }
    monkeypatch.chdir(write(folder, brings))
    return folder


@pytest.fixture
def begins(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Put back what `begin` sets."""
    for name in (*os.environ, WORKSPACE):
        monkeypatch.setenv(name, os.environ.get(name, str(tmp_path / "ws")))


@pytest.mark.parametrize("verb", [["check", "Q5"], ["grade", ".", "--out", "../out", "--rubric", "../none"]])
def test_a_course_that_a_submission_brings_is_named_in_one_line_and_not_used(
    verb: list[str], inside: Path, capsys: pytest.CaptureFixture[str]
):
    """Its Python ran as the user who grades, and its rubric gave the points."""
    cli.main(verb)
    (line,) = [line for line in capsys.readouterr().err.splitlines() if "course.yaml" in line]
    words = "is not used. If that course is yours, add: --course ., or set"
    assert line == f"grader: {inside}/course.yaml {words} {VARIABLE}={inside}"
    assert not [*inside.rglob("*.ran")]


def test_a_course_in_a_submission_is_named_in_its_report(inside: Path, tmp_path: Path):
    intake = open_submission(inside, tmp_path / "in", kits_own()).intake
    assert "course.yaml is not used: no course comes from a submission." in intake.notes


@pytest.mark.usefixtures("begins")
def test_a_notebook_in_somebody_elses_workspace_says_so_and_uses_the_kits_course(
    inside: Path, capsys: pytest.CaptureFixture[str]
):
    notebook.begin("00")
    assert f"{inside}/course.yaml is not used." in capsys.readouterr().out
    assert find() is kits_own()


def test_an_authors_verb_in_the_folder_of_a_course_says_what_to_type(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    monkeypatch.delenv(VARIABLE, raising=False)
    mine = course_command.lay_out(tmp_path / "mine").folder
    before = kits_own().rubric.read_bytes()
    monkeypatch.chdir(mine / "checks")
    for verb in (["release", "--out", "kit.zip"], ["check-course", "--static"]):
        assert cli.main(verb) == 2
        assert f"{mine}/course.yaml is not used. If that course is yours, add: --course .." in capsys.readouterr().err
    assert cli.main(["check-course", "--static", "--course", ".."]) == 0
    assert kits_own().rubric.read_bytes() == before


@pytest.mark.usefixtures("begins")
def test_a_course_named_as_seen_from_here_is_the_same_after_begin_has_gone_elsewhere(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    mine = course_command.lay_out(tmp_path / "mine")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv(VARIABLE, "mine")
    notebook.begin("01")
    assert find() is mine


def test_an_empty_variable_names_no_course(inside: Path, monkeypatch: pytest.MonkeyPatch):
    """It was taken for the current folder."""
    monkeypatch.setenv(VARIABLE, "")
    assert find() is kits_own()


# -- other things that are found by place ------------------------------------------------------------------------------


def test_no_python_that_the_kit_starts_looks_for_modules_in_the_current_folder():
    """`grader doctor` imported rclpy from it. Two start in a folder of the grader's own."""
    starts = re.compile(r'sys\.executable, "-[mc]"')
    found = [path.name for path in (KIT / "grader").rglob("*.py") if starts.search(path.read_text())]
    assert sorted(found) == ["observers.py", "one_grading.py"]


def test_a_search_path_without_more_folders_has_no_empty_part(monkeypatch: pytest.MonkeyPatch):
    """Python and the dynamic linker take an empty part for the current folder."""
    monkeypatch.delenv("PYTHONPATH", raising=False)
    started = []
    monkeypatch.setattr(supervised.subprocess, "Popen", lambda *_, env, **__: started.append(env["PYTHONPATH"]))
    supervised.start("grader.cli")
    assert started == [str(KIT)]


def test_pictures_are_drawn_without_the_settings_of_the_current_folder(tmp_path: Path):
    """A matplotlibrc that is no text ended a grading."""
    (tmp_path / "matplotlibrc").write_bytes(b"\xff\xfe")
    script = "from grader.report import figures; figures._pictures()"
    subprocess.run([sys.executable, "-c", script], cwd=tmp_path, check=True)


def test_git_is_not_asked_for_a_repository_above_the_kit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Its settings can start programs."""
    monkeypatch.setattr(provenance, "KIT", tmp_path)
    monkeypatch.setattr(provenance, "_git", lambda *_: pytest.fail("asked"))
    assert (provenance.commit(), provenance.commit_time()) == ("", 0)
