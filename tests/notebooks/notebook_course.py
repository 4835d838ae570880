"""Both runs of the notebooks, beside each other: untouched and alone, and solved in a row in one workspace.

Each notebook is run once in each way, as far as tests ask for it. Three run at a time, one of the row and two alone: a
notebook waits as well as computes, for discovery, for a process to start, for a build.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack
from pathlib import Path

from notebook_rooms import room
from notebook_validation import Validation, validate

from grader import build
from grader.course import pages, performance, stages
from grader.rubric import Rubric


class Course:
    """The runs that tests ask for, begun before the first of them is waited for."""

    def __init__(self, folder: Path, rubric: Rubric, untouched: Sequence[str], solved: Sequence[str]) -> None:
        self._rooms = ExitStack()
        self.workspace = self._rooms.enter_context(room(folder)) / "ws"
        self.rubric = rubric
        self._alone, self._row = ThreadPoolExecutor(2), ThreadPoolExecutor(1)
        self._untouched: dict[str, Future[Validation]] = {
            name: self._alone.submit(validate, pages.NOTEBOOKS / f"{name}.ipynb") for name in untouched
        }
        # The row has no gaps: a notebook builds on what those before it have left.
        before = pages.names()[: 1 + max((pages.names().index(name) for name in solved), default=-1)]
        self._solved: dict[str, Future[performance.Performance]] = {
            name: self._row.submit(self._play, name) for name in before
        }

    def _play(self, name: str) -> performance.Performance:
        notebook = performance.solved(name, pages.read(name, self.rubric), stages.exercise)
        return performance.play(notebook, self.workspace)

    def untouched(self, name: str) -> Validation:
        """Return what nbval found in the notebook, run alone as it is shipped."""
        return self._untouched[name].result()

    def solved(self, name: str) -> performance.Performance:
        """Return the notebook, run after those before it with the reference's files in the exercises."""
        return self._solved[name].result()

    @property
    def package(self) -> Path:
        """Return the package that the row leaves."""
        return self.workspace / "src" / build.PACKAGE

    def close(self) -> None:
        """Begin nothing more, and wait for what runs."""
        for pool in (self._alone, self._row):
            pool.shutdown(cancel_futures=True)
        self._rooms.close()
