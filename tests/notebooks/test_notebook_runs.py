"""Every notebook runs from top to bottom: the student edition by itself, the published one in the course's order.

Each notebook runs once in each way if a test asks for it. Four run at a time, because a notebook often waits: for
discovery, a process, a build. So the published ones run in two sequences, unless the package at the end of the whole
course is wanted; one that does not begin with the first notebook begins with the package that `start_at` lays out.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from helpers import course as spec
from helpers.notebook_rules import OF_UNTOUCHED_RUNS, Page
from helpers.notebook_validation import IN_A_SHORTER_LANE, Validation, validate

from grader import cli
from grader.authoring import book, notebook_run, notebook_source
from grader.notebook import lanes
from grader.notebook.workspace import Workspace

STARTS = ("06_services",)  # two about equal parts
SHORTER = "core"  # the lane that runs besides the whole one
NAMES = notebook_source.names()
IN_LANES = [name for name in NAMES if name[:2] in lanes.minutes(SHORTER)]
pytestmark = [pytest.mark.ros, pytest.mark.sandbox]


class Course:
    """The runs that tests ask for, all started at once."""

    def __init__(
        self,
        folder: Path,
        untouched: Sequence[str],
        published: Sequence[str],
        shorter: Sequence[str] = (),
        *,
        whole: bool = False,
    ) -> None:
        self._stack = ExitStack()
        pool = self._pool(2)
        self._untouched: dict[str, Future[notebook_run.NotebookRun]] = {
            name: pool.submit(_run_untouched, name) for name in untouched
        }
        self._validated: dict[tuple[str, str], Future[Validation]] = {}
        self._folder, self._packages = folder, {}
        for sequence in sequences(published, notebook_source.names(), () if whole else STARTS):
            self._follow(sequence, lanes.WHOLE)
        for sequence in sequences(shorter, notebook_source.names(), ()):
            self._follow(sequence, SHORTER)

    def _follow(self, sequence: Sequence[str], lane: str) -> None:
        """Start the published notebooks of a lane, one after the other in a workspace of their own."""
        workspace = Path(self._stack.enter_context(_folder(self._folder))).resolve() / "ws"
        self._packages[lane] = workspace / "src" / spec.PACKAGE
        pool = self._pool()
        for name in sequence:
            lay_out = name == sequence[0] != notebook_source.names()[0]
            self._validated[lane, name] = pool.submit(_validate, name, workspace, lane, lay_out=lay_out)

    def _pool(self, threads: int = 1) -> ThreadPoolExecutor:
        """Return new threads; when the course is closed, they start nothing more and their current runs are awaited."""
        pool = ThreadPoolExecutor(threads)
        self._stack.callback(pool.shutdown, cancel_futures=True)
        return pool

    def untouched(self, name: str) -> notebook_run.NotebookRun:
        """Return the run of the student edition, by itself."""
        return self._untouched[name].result()

    def published(self, name: str, lane: str = lanes.WHOLE) -> Validation:
        """Return nbval's result for the published edition in a lane, after those before it in its sequence."""
        return self._validated[lane, name].result()

    def package(self, lane: str = lanes.WHOLE) -> Path:
        """Return the package that the last sequence in a lane leaves."""
        return self._packages[lane]

    def close(self) -> None:
        """Start nothing more, wait for the current runs, and delete the folders."""
        self._stack.close()


def sequences(asked: Sequence[str], names: Sequence[str], starts: Sequence[str]) -> list[list[str]]:
    """Return the asked notebooks in the course's order, in runs without gaps; each of `starts` begins a new one."""
    runs: list[list[str]] = []
    for before, name in zip(["", *names], names, strict=False):
        if name in asked:
            if name in starts or before not in asked:
                runs.append([])
            runs[-1].append(name)
    return runs


def _validate(name: str, workspace: Path, lane: str, *, lay_out: bool) -> Validation:
    if lay_out:
        notebook_run.lay_out(name, workspace)
    lanes.keep(Workspace(workspace), lane)
    path = book.published_file(name)
    if lane == lanes.WHOLE:
        return validate(path, workspace)
    folded = lanes.fold(book.read_stored(path), name[:2], lane)
    book.write(folded, workspace.parent / path.name)
    return validate(workspace.parent / path.name, workspace, may_differ=IN_A_SHORTER_LANE)


def _run_untouched(name: str) -> notebook_run.NotebookRun:
    with _folder() as folder:
        workspace = Path(folder).resolve() / "ws"
        run = notebook_run.execute(book.read_stored(book.student_file(name)), workspace)
        notebook_run.clean(run.notebook, workspace)
    return run


def _folder(parent: Path | None = None) -> TemporaryDirectory[str]:
    return TemporaryDirectory(prefix="notebook-", dir=parent, ignore_cleanup_errors=True)


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
