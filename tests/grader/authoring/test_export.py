"""What platforms that grade by themselves get. tests/containers runs it."""

from __future__ import annotations

import json
import re
import shutil
import stat
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
import yaml
from helpers.course import COURSE

from grader import KIT, cli
from grader.authoring import course_command, release


@pytest.fixture
def autograder(tmp_path: Path) -> zipfile.ZipFile:
    release.gradescope(tmp_path / "autograder.zip", COURSE, 30)
    return zipfile.ZipFile(tmp_path / "autograder.zip")


def test_gradescope_finds_its_two_programs_at_the_top_and_can_run_them(autograder: zipfile.ZipFile):
    for name in ("setup.sh", "run_autograder"):
        info = autograder.getinfo(name)
        assert info.external_attr >> 16 & stat.S_IXUSR
        text = autograder.read(info)
        assert text.startswith(b"#!/usr/bin/env bash\n")
        assert subprocess.run(["bash", "-n"], input=text, check=False).returncode == 0


def test_a_grading_ends_before_the_platform_ends_it(autograder: zipfile.ZipFile):
    assert "SECONDS:-1740}" in autograder.read("run_autograder").decode()  # 30 minutes but one


def test_an_autograder_holds_the_grader_and_not_the_solution(autograder: zipfile.ZipFile):
    names = autograder.namelist()
    assert {"kit/Makefile", "kit/.ci/setup", "kit/grader/cli.py", "kit/sim/world.py", "kit/requirements.txt"} <= {
        *names
    }
    assert not [name for name in names if "solution_pkg" in name or "/selftest/" in name or "__pycache__" in name]


def test_the_template_repository_has_a_workflow_and_the_kit(tmp_path: Path):
    release.github(tmp_path / "template.zip", COURSE)
    assert [path.name for path in tmp_path.iterdir()] == ["template.zip"]
    template = zipfile.ZipFile(tmp_path / "template.zip")
    workflow = yaml.safe_load(template.read(".github/workflows/classroom.yml"))
    steps = workflow["jobs"]["grade"]["steps"]
    assert steps[-1]["env"] == {"GRADE_RESULTS": "${{ steps.grade.outputs.result }}"}
    assert "@" not in "".join(step.get("run", "") for step in steps)
    with template.open("kit.zip") as kit:
        assert f"{release.TOP}/grader/cli.py" in zipfile.ZipFile(kit).namelist()


def test_a_course_of_ones_own_is_in_an_autograder_with_all_that_judges_it(tmp_path: Path):
    """`grader export` had no --course, so the autograder graded by the kit's own."""
    course = course_command.lay_out(tmp_path / "mine")
    (course.folder / "held_back").mkdir()
    (course.folder / "held_back" / "check_x1.py").touch()
    out = tmp_path / "autograder.zip"
    assert cli.main(["export", "gradescope", "--course", str(course.folder), "--out", str(out)]) == 0
    with zipfile.ZipFile(out) as opened:
        opened.extractall(tmp_path)
    folder = tmp_path / "kit" / "course"
    names = {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}
    assert {"trials/patrol.py", "held_back/check_x1.py", "rubric.yaml", "contract/contract.yaml"} <= names
    assert not [name for name in names if name.startswith(("solution", "notebooks/", "known_bad"))]
    script = "from grader.course import find; print(find().package, find().folder)"
    found = subprocess.run(
        [sys.executable, "-c", script], cwd=tmp_path / "kit", capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert found.stdout == f"hall_guard {folder}\n"


def test_a_rubric_outside_of_the_courses_folder_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    folder = shutil.copytree(course_command.lay_out(tmp_path / "laid_out").folder, tmp_path / "mine")
    (folder / "rubric.yaml").rename(tmp_path / "rubric.yaml")
    (folder / "course.yaml").write_text("title: x\npackage: hall_guard\nrubric: ../rubric.yaml\n")
    assert cli.main(["export", "github", "--course", str(folder), "--out", str(tmp_path / "a.zip")]) == 3
    assert "rubric.yaml is not in the course's folder" in capsys.readouterr().err


def test_the_devcontainer_builds_the_containerfile():
    text = re.sub(r"(?m)^//.*$", "", (KIT / ".devcontainer" / "devcontainer.json").read_text())
    settings = json.loads(text)
    folder = KIT / ".devcontainer"
    assert (folder / settings["build"]["dockerfile"]).resolve() == KIT / "Containerfile"
    assert (folder / settings["build"]["context"]).resolve() == KIT
