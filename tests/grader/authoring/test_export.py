"""What platforms that grade by themselves get. tests/containers runs it."""

from __future__ import annotations

import json
import re
import stat
import subprocess
import zipfile
from pathlib import Path

import pytest
import yaml

from grader import KIT
from grader.authoring import export


@pytest.fixture
def autograder(tmp_path: Path) -> zipfile.ZipFile:
    export.gradescope(tmp_path / "autograder.zip", 30)
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
    export.github(tmp_path / "template.zip")
    assert [path.name for path in tmp_path.iterdir()] == ["template.zip"]
    template = zipfile.ZipFile(tmp_path / "template.zip")
    workflow = yaml.safe_load(template.read(".github/workflows/classroom.yml"))
    steps = workflow["jobs"]["grade"]["steps"]
    assert steps[-1]["env"] == {"GRADE_RESULTS": "${{ steps.grade.outputs.result }}"}
    assert "@" not in "".join(step.get("run", "") for step in steps)
    with template.open("kit.zip") as kit:
        assert f"{export.TOP}/grader/cli.py" in zipfile.ZipFile(kit).namelist()


def test_the_devcontainer_builds_the_containerfile():
    text = re.sub(r"(?m)^//.*$", "", (KIT / ".devcontainer" / "devcontainer.json").read_text())
    settings = json.loads(text)
    folder = KIT / ".devcontainer"
    assert (folder / settings["build"]["dockerfile"]).resolve() == KIT / "Containerfile"
    assert (folder / settings["build"]["context"]).resolve() == KIT
