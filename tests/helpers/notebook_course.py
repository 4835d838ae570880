"""Both runs of the notebooks, beside each other: untouched and alone, and solved in a row in one workspace.

Each notebook is run once in each way, as far as tests ask for it. Three run at a time, for a notebook waits as well as
computes: for discovery, for a process to start, for a build. So the row is two, unless somebody asks for what a whole
one leaves: the second begins in the middle, as a student may, with what `start_at` lays out.
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
from helpers.notebook_rooms import room
from helpers.notebook_validation import Validation, validate

MIDDLE = "07_going_there"


class Course:
    """The runs that tests ask for, begun before the first of them is waited for."""

    def __init__(
        self, folder: Path, rubric: Rubric, untouched: Sequence[str], solved: Sequence[str], *, whole: bool = False
    ) -> None:
        self._open = ExitStack()
        self.rubric = rubric
        self._alone, self._rows = ThreadPoolExecutor(1), []
        self._untouched: dict[str, Future[Validation]] = {
            name: self._alone.submit(validate, notebook_source.NOTEBOOKS / f"{name}.ipynb") for name in untouched
        }
        self._solved: dict[str, Future[notebook_run.Performance]] = {}
        names = notebook_source.names()
        middle = 0 if whole else names.index(MIDDLE)
        for row in (names[:middle], names[middle:]):
            # A row has no gaps: a notebook builds on what those before it have left.
            wanted = row[: 1 + max((row.index(name) for name in solved if name in row), default=-1)]
            self.workspace = self._open.enter_context(room(folder)) / "ws"
            pool = ThreadPoolExecutor(1)
            self._rows.append(pool)
            for name in wanted:
                self._solved[name] = pool.submit(self._play, name, self.workspace, begins=name == row[0] == MIDDLE)

    def _play(self, name: str, workspace: Path, begins: bool) -> notebook_run.Performance:
        if begins:
            checkpoints.start_at(Workspace(workspace), name)
        notebook = notebook_run.solved(name, notebook_source.read(name, self.rubric), checkpoint_texts.solution)
        return notebook_run.play(notebook, workspace)

    def untouched(self, name: str) -> Validation:
        """Return what nbval found in the notebook, run alone as it is shipped."""
        return self._untouched[name].result()

    def solved(self, name: str) -> notebook_run.Performance:
        """Return the notebook, run after those before it in its row, with the reference's files in the exercises."""
        return self._solved[name].result()

    @property
    def package(self) -> Path:
        """Return the package that the last row leaves."""
        return self.workspace / "src" / spec.PACKAGE

    def close(self) -> None:
        """Begin nothing more, and wait for what runs."""
        for pool in (self._alone, *self._rows):
            pool.shutdown(cancel_futures=True)
        self._open.close()
