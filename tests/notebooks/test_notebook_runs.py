"""Every notebook runs from top to bottom: the student edition by itself, the published one in the course's order."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import pytest
from helpers.notebook_course import Course
from helpers.notebook_rules import OF_UNTOUCHED_RUNS, Page

from grader import cli
from grader.authoring import notebook_source

NAMES = notebook_source.names()
OFTEN = ("04", "07")
pytestmark = [pytest.mark.ros, pytest.mark.sandbox]


@pytest.fixture(scope="module")
def course(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Course]:
    asked: dict[str, list[str]] = {"untouched": [], "published": []}
    for item in request.session.items:
        if item.path == request.path and (kind := next((kind for kind in asked if f"_{kind}" in item.name), None)):
            asked[kind].append(item.callspec.params["name"] if hasattr(item, "callspec") else NAMES[-1])
    whole = any(item.path == request.path and "_to_the_end" in item.name for item in request.session.items)
    course = Course(tmp_path_factory.mktemp("course"), asked["untouched"], asked["published"], whole=whole)
    yield course
    course.close()


SELDOM = pytest.mark.slow  # 02 alone builds interfaces for 110 CPU seconds, and its published run builds them, too


@pytest.mark.parametrize("name", [pytest.param(name, marks=() if name[:2] in OFTEN else SELDOM) for name in NAMES])
def test_untouched_and_alone_it_runs_and_each_check_says_not_yet(name: str, course: Course):
    """In an empty workspace: a student may open any notebook first."""
    run = course.untouched(name)
    assert run.error is None
    page = Page(name, run.notebook, notebook_source.NOTEBOOKS)
    assert [problem for rule in OF_UNTOUCHED_RUNS for problem in rule(page)] == []


@pytest.mark.parametrize("name", NAMES)
def test_published_it_shows_what_a_solved_run_shows(name: str, course: Course):
    """No exception, and each output as published; another rule asserts that the published checks say "passed"."""
    found = course.published(name)
    assert not found.problems, "\n".join(found.problems)
    assert found.cells > 0


@pytest.mark.slow  # a whole grading
def test_published_to_the_end_the_package_gets_all_points(course: Course, tmp_path: Path):
    course.published(NAMES[-1])
    assert cli.main(["grade", str(course.package), "--out", str(tmp_path)]) == 0
    assert json.loads((tmp_path / "report.json").read_text())["total"] == 100
