"""Every notebook runs from top to bottom: the student edition by itself, the published one in the course's order."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import pytest
from helpers.notebook_course import SHORTER, Course, sequences
from helpers.notebook_rules import OF_UNTOUCHED_RUNS, Page

from grader import cli
from grader.authoring import notebook_source
from grader.notebook import lanes

NAMES = notebook_source.names()
IN_LANES = [name for name in NAMES if name[:2] in lanes.minutes(SHORTER)]
pytestmark = [pytest.mark.ros, pytest.mark.sandbox]


def all_but(short: str) -> list[object]:
    """Return the notebooks as parameters: `short` is run by `make test`, the others by `make test-notebooks` alone."""
    return [pytest.param(name, marks=() if name == short else pytest.mark.notebooks) for name in NAMES]


@pytest.fixture(scope="module")
def course(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Course]:
    here = [item for item in request.session.items if item.path == request.path]
    asked = {
        kind: [item.callspec.params["name"] for item in here if f"_{kind}" in item.name and hasattr(item, "callspec")]
        for kind in ("untouched", "published", "shorter")
    }
    to_the_end = {kind for kind in asked for item in here if f"_{kind}_to_the_end" in item.name}
    published = NAMES if "published" in to_the_end else asked["published"]
    shorter = IN_LANES if "shorter" in to_the_end else asked["shorter"]
    course = Course(
        tmp_path_factory.mktemp("course"), asked["untouched"], published, shorter, whole="published" in to_the_end
    )
    yield course
    course.close()


@pytest.mark.parametrize("name", all_but("03_numbers_of_motion"))
def test_untouched_and_alone_it_runs_and_each_check_says_not_yet(name: str, course: Course):
    """In an empty workspace: a student may open any notebook first."""
    run = course.untouched(name)
    assert run.error is None
    page = Page(name, run.notebook, notebook_source.NOTEBOOKS)
    assert [problem for rule in OF_UNTOUCHED_RUNS for problem in rule(page)] == []


@pytest.mark.parametrize("name", all_but("00_first_drive"))
def test_published_it_shows_what_a_solved_run_shows(name: str, course: Course):
    """No exception, and each output as published; another rule asserts that the published checks say "passed"."""
    found = course.published(name)
    assert not found.problems, "\n".join(found.problems)
    assert found.cells > 0


@pytest.mark.notebooks
@pytest.mark.parametrize("name", IN_LANES)
def test_in_the_shorter_lane_it_shows_what_a_solved_run_shows(name: str, course: Course):
    """Only the lane's cells run: none of them needs one that the lane leaves out."""
    found = course.published(name, SHORTER)
    assert not found.problems, "\n".join(found.problems)
    assert found.cells > 0


def test_notebooks_that_follow_each_other_share_a_workspace():
    assert sequences(["b", "c", "d"], list("abcdef"), ["d"]) == [["b", "c"], ["d"]]
    assert sequences(["a", "f"], list("abcdef"), ["d"]) == [["a"], ["f"]]


@pytest.mark.slow  # a whole grading
def test_published_to_the_end_the_package_gets_all_points(course: Course, tmp_path: Path):
    course.published(NAMES[-1])
    assert cli.main(["grade", str(course.package()), "--out", str(tmp_path)]) == 0
    assert json.loads((tmp_path / "report.json").read_text())["total"] == 100


@pytest.mark.slow  # a whole grading
def test_shorter_to_the_end_the_package_gets_all_points(course: Course, tmp_path: Path):
    course.published(IN_LANES[-1], SHORTER)
    assert cli.main(["grade", str(course.package(SHORTER)), "--out", str(tmp_path)]) == 0
    assert json.loads((tmp_path / "report.json").read_text())["total"] == 100
