"""docs/own-course.md: what it says to type works, from an empty folder to a graded class."""

from __future__ import annotations

import csv
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from grader import KIT, cli
from grader.authoring import check_course
from grader.course import load
from grader.trials import catalog

PAGE = (KIT / "docs" / "own-course.md").read_text()
STEP = re.compile(r"(?ms)^    (?P<command>\w[^\n]*)$|`(?P<file>mycourse/[\w/.]+)`[^\n]*:\n\n```\w+\n(?P<text>.*?)```")
GRADES = ("grader check-course mycourse", "grader batch", "grader gradebook")


def forget() -> None:
    """Forget the trials and checks of the course in this folder: each command is a process of its own."""
    catalog.trials.cache_clear()
    for name, module in [*sys.modules.items()]:
        if name.startswith("course_") and str(Path.cwd()) in str(vars(module)):
            del sys.modules[name]


def do(step: re.Match[str]) -> None:
    """Type a command, or write a file; an entry of the rubric goes to the end of the first criterion."""
    if step["file"] and step["file"].endswith("rubric.yaml"):
        rubric, end = Path(step["file"]), "\n\n  # All these checks"
        before, _, after = rubric.read_text().partition(end)
        rubric.write_text(f"{before}\n{step['text'].rstrip()}{end}{after}")
    elif step["file"]:
        Path(step["file"]).write_text(step["text"])
    elif step["command"].startswith("grader "):
        forget()
        assert cli.main(shlex.split(step["command"])[1:]) == 0, step["command"]
    else:
        subprocess.run(step["command"], shell=True, check=True)


def steps() -> Iterator[re.Match[str]]:
    return STEP.finditer(PAGE)


@pytest.fixture(autouse=True)
def _in_an_empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS2_COURSE", "")  # `release` sets it
    monkeypatch.delenv("ROS2_COURSE")
    monkeypatch.chdir(tmp_path)


def test_every_command_but_the_gradings_works_as_typed(tmp_path: Path):
    for step in steps():
        if not (step["command"] or "").startswith(GRADES):
            do(step)
    forget()
    course = load(tmp_path / "mycourse")
    assert check_course.read_rubric(course).requirement("B4").points == 5
    assert sum(criterion.points for criterion in check_course.read_rubric(course).criteria) == 105
    assert {path.name for path in tmp_path.iterdir()} == {"mycourse", "handout.md", "kit.zip", "handed_in"}
    assert "B4" in (tmp_path / "mycourse" / "rubric.yaml").read_text()


@pytest.mark.ros
@pytest.mark.sandbox
@pytest.mark.slow  # twice the gradings of check-course, and a class of three
def test_every_command_of_the_page_works_as_typed(tmp_path: Path):
    for step in steps():
        do(step)
    rows = list(csv.DictReader((tmp_path / "class" / "gradebook.csv").read_text().splitlines()))
    assert [row["submission"] for row in rows] == ["team01", "team02", "team03"]
    points = [float(row["total"]) for row in rows]
    assert points[0] == 105
    assert points[0] > points[1] > points[2] > 50
