"""The two notebooks made from one source: the student edition and the published one. Runs nothing.

The student edition, notebooks/NN_topic.ipynb, has stubs in its exercises and no outputs, so no question is answered
below it. The published edition, notebooks/published/NN_topic.ipynb, is the run with the course's solutions.
"""

from __future__ import annotations

import re
from pathlib import Path

import nbformat
from nbformat import NotebookNode

from grader.authoring import checkpoint_texts, notebook_run, notebook_source
from grader.scoring.rubric import Rubric

FOLDER = "published"
NOTE = "edition"
"""The id of the cell that tells a visitor which edition this is."""

# The target of a Markdown link or of a picture, without an address, a place on the page, or another notebook.
_BESIDE = re.compile(r"(\]\(|<img[^>]*\ssrc=\")(?!\w+:|//|#|\d\d_\w+\.ipynb)(?=[^)\s\"])")


def student_file(name: str, notebooks: Path = notebook_source.NOTEBOOKS) -> Path:
    """Return the file of the student edition."""
    return notebooks / f"{name}.ipynb"


def published_file(name: str, notebooks: Path = notebook_source.NOTEBOOKS) -> Path:
    """Return the file of the published edition."""
    return notebooks / FOLDER / f"{name}.ipynb"


def student(name: str, rubric: Rubric, notebooks: Path = notebook_source.NOTEBOOKS) -> NotebookNode:
    """Return the notebook as students open it: stubs, nbgrader's metadata, no outputs."""
    return notebook_source.read(name, rubric, notebooks)


def published(
    name: str,
    rubric: Rubric,
    notebooks: Path = notebook_source.NOTEBOOKS,
    solutions: notebook_run.Solutions = checkpoint_texts.solution,
) -> NotebookNode:
    """Return the notebook with solved exercises and a note for visitors, before it is run."""
    notebook = notebook_run.solved(name, notebook_source.read(name, rubric, notebooks), solutions)
    for cell in notebook.cells:
        cell.metadata.pop("nbgrader", None)
        if cell.cell_type == "markdown":
            cell.source = _BESIDE.sub(r"\1../", cell.source)
    notebook.cells.insert(1, nbformat.v4.new_markdown_cell(_note(name), id=NOTE))
    return notebook


def _note(name: str) -> str:
    return (
        "> **The published edition**, to look at: the exercises are solved, and every output comes from that run.\n"
        f"> To write the solutions yourself, open [the student edition](../{name}.ipynb)."
    )
