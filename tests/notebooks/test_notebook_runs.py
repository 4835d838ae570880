"""Every notebook runs from top to bottom: alone and untouched, and solved, all in a row in one workspace."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import pytest
from notebook_validation import validate

from grader import build, cli
from grader.course import pages, performance, stages
from grader.rubric import Rubric

NAMES = pages.names()
pytestmark = [pytest.mark.ros, pytest.mark.sandbox]


class Course:
    """One student's way through the course: each notebook is run once, after those before it, in one workspace."""

    def __init__(self, workspace: Path, rubric: Rubric) -> None:
        self.workspace = workspace
        self.rubric = rubric
        self.played: dict[str, performance.Performance] = {}

    def after(self, name: str) -> performance.Performance:
        """Return the notebook `name`, run with the reference's files in its exercises."""
        for before in NAMES[: NAMES.index(name) + 1]:
            if before not in self.played:
                notebook = performance.solved(before, pages.read(before, self.rubric), stages.exercise)
                self.played[before] = performance.play(notebook, self.workspace)
        return self.played[name]

    @property
    def package(self) -> Path:
        return self.workspace / "src" / build.PACKAGE


@pytest.fixture(scope="module")
def course(tmp_path_factory: pytest.TempPathFactory, rubric: Rubric) -> Iterator[Course]:
    return Course(tmp_path_factory.mktemp("course") / "ws", rubric)


@pytest.mark.parametrize("name", NAMES)
def test_untouched_and_alone_it_shows_what_is_stored(name: str):
    """No exception, and each output as stored; that the stored checks say "not yet" is a rule of its own."""
    found = validate(pages.NOTEBOOKS / f"{name}.ipynb")
    assert not found.problems, "\n".join(found.problems)
    assert found.cells > 0


@pytest.mark.parametrize("name", NAMES)
def test_solved_its_checks_pass(name: str, course: Course):
    played = course.after(name)
    assert played.error is None
    assert performance.unpassed(played.notebook) == []


@pytest.mark.slow
def test_the_package_of_the_last_notebook_gets_all_points(course: Course, tmp_path: Path):
    course.after(NAMES[-1])
    assert cli.main(["grade", str(course.package), "--out", str(tmp_path)]) == 0
    assert json.loads((tmp_path / "report.json").read_text())["total"] == 100
