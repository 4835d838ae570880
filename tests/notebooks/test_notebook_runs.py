"""Every notebook runs from top to bottom: untouched in an empty workspace, and solved, in order in one workspace."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import pytest
from helpers.notebook_course import Course

from grader import cli
from grader.authoring import notebook_run, notebook_source
from grader.scoring.rubric import Rubric

NAMES = notebook_source.names()
pytestmark = [pytest.mark.ros, pytest.mark.sandbox]


@pytest.fixture(scope="module")
def course(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory, rubric: Rubric
) -> Iterator[Course]:
    asked: dict[str, list[str]] = {"untouched": [], "solved": []}
    for item in request.session.items:
        if item.path == request.path and (kind := next((kind for kind in asked if f"_{kind}" in item.name), None)):
            asked[kind].append(item.callspec.params["name"] if hasattr(item, "callspec") else NAMES[-1])
    whole = any(item.path == request.path and item.get_closest_marker("slow") for item in request.session.items)
    course = Course(tmp_path_factory.mktemp("course"), rubric, asked["untouched"], asked["solved"], whole=whole)
    yield course
    course.close()


@pytest.mark.parametrize("name", NAMES)
def test_untouched_and_alone_it_shows_what_is_stored(name: str, course: Course):
    """No exception, and each output as stored; another rule asserts that the stored checks say "not yet"."""
    found = course.untouched(name)
    assert not found.problems, "\n".join(found.problems)
    assert found.cells > 0


@pytest.mark.parametrize("name", NAMES)
def test_solved_its_checks_pass(name: str, course: Course):
    run = course.solved(name)
    assert run.error is None
    assert notebook_run.not_passed(run.notebook) == [], "\n".join(notebook_run.check_outputs(run.notebook))
    assert notebook_run.cells_not_yet(run.notebook) == []


@pytest.mark.slow
def test_solved_to_the_end_the_package_gets_all_points(course: Course, tmp_path: Path):
    course.solved(NAMES[-1])
    assert cli.main(["grade", str(course.package), "--out", str(tmp_path)]) == 0
    assert json.loads((tmp_path / "report.json").read_text())["total"] == 100
