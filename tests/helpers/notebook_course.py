"""Run the notebooks in the background in two ways: untouched, each by itself, and solved, in order in one workspace.

Each notebook runs once in each way if a test asks for it. Three run at a time, because a notebook often waits: for
discovery, a process, a build. So the solved ones run in two sequences, unless the package at the end of the whole
course is wanted; the second sequence begins with the package that `start_at` lays out.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack
from pathlib import Path

from grader.authoring import checkpoint_texts, notebook_run, notebook_source
from grader.contract import spec
from grader.notebook import checkpoints
from grader.notebook.workspace import Workspace
from grader.scoring.rubric import Rubric
from helpers.notebook_isolation import isolated_folder
from helpers.notebook_validation import Validation, validate

MIDDLE = "07_going_there"


class Course:
    """The runs that tests ask for, all started at once."""

    def __init__(
        self, folder: Path, rubric: Rubric, untouched: Sequence[str], solved: Sequence[str], *, whole: bool = False
    ) -> None:
        self._stack = ExitStack()
        self.rubric = rubric
        pool = self._pool()
        self._untouched: dict[str, Future[Validation]] = {
            name: pool.submit(validate, notebook_source.NOTEBOOKS / f"{name}.ipynb") for name in untouched
        }
        self._solved: dict[str, Future[notebook_run.NotebookRun]] = {}
        names = notebook_source.names()
        middle = 0 if whole else names.index(MIDDLE)
        for sequence in (names[:middle], names[middle:]):
            # A sequence has no gaps: each notebook builds on the package that the ones before it leave.
            last = max((sequence.index(name) for name in solved if name in sequence), default=-1)
            self.workspace = self._stack.enter_context(isolated_folder(folder)) / "ws"
            pool = self._pool()
            for name in sequence[: last + 1]:
                lay_out = name == sequence[0] == MIDDLE
                self._solved[name] = pool.submit(self._solve, name, self.workspace, lay_out=lay_out)

    def _pool(self) -> ThreadPoolExecutor:
        """Return a new thread; when the course is closed, it starts nothing more and its current run is awaited."""
        pool = ThreadPoolExecutor(1)
        self._stack.callback(pool.shutdown, cancel_futures=True)
        return pool

    def _solve(self, name: str, workspace: Path, lay_out: bool) -> notebook_run.NotebookRun:
        if lay_out:
            checkpoints.start_at(Workspace(workspace), name)
        notebook = notebook_run.solved(name, notebook_source.read(name, self.rubric), checkpoint_texts.solution)
        return notebook_run.execute(notebook, workspace)

    def untouched(self, name: str) -> Validation:
        """Return nbval's result for the notebook, run by itself as it is shipped."""
        return self._untouched[name].result()

    def solved(self, name: str) -> notebook_run.NotebookRun:
        """Return the run of the solved notebook, after those before it in its sequence."""
        return self._solved[name].result()

    @property
    def package(self) -> Path:
        """Return the package that the last sequence leaves."""
        return self.workspace / "src" / spec.PACKAGE

    def close(self) -> None:
        """Start nothing more, wait for the current runs, and delete the folders."""
        self._stack.close()
