"""Take the last hints out of a student edition, so that they can appear where an exercise was tried in vain."""

from __future__ import annotations

import json
import re

from nbformat import NotebookNode

from grader.authoring import notebook_source
from grader.errors import GraderError
from grader.notebook import last_hint

_EXERCISES = {notebook_source.EXERCISE, notebook_source.PIECE, notebook_source.FUNCTION}
_TRY = re.compile(rf"^ *(?:tries|check|mutant_matrix)\(|{last_hint.PYTEST.pattern}", re.MULTILINE)


def take_out(notebook: NotebookNode) -> dict[str, str]:
    """Replace the last hints on a notebook's pages, in place, and return them by what their exercises write.

    A hint is about the exercises above it, up to the hint before or a heading. One stays on its page if no exercise is
    there, or nothing tries that exercise before the next one.

    Raises:
        GraderError: two exercises with different hints write the same function.
    """
    found: dict[str, str] = {}
    above: list[NotebookNode] = []
    for cell in notebook.cells:
        if _EXERCISES & {*notebook_source.tags(cell)}:
            above.append(cell)
        elif cell.cell_type == "markdown" and last_hint.FOLD.search(cell.source):
            about = [each.source for each in above if _is_tried(notebook, above[-1])]
            cell.source, taken = last_hint.take_out(cell.source, about)
            for name, hint in taken.items():
                if found.setdefault(name, hint) != hint:
                    raise GraderError(f"Two exercises with different last hints write {name}.")
            above = []
        if any(True for _ in notebook_source.headings(cell)):
            above = []
    return found


def _is_tried(notebook: NotebookNode, exercise: NotebookNode) -> bool:
    """Return whether a cell before the next exercise tries this one."""
    for cell in notebook.cells[notebook.cells.index(exercise) + 1 :]:
        if _EXERCISES & {*notebook_source.tags(cell)}:
            return False
        if cell.cell_type == "code" and _TRY.search(cell.source):
            return True
    return False


def text(taken: dict[str, str]) -> str:
    """Return the text of the file in which a kernel finds them, "" without any."""
    return json.dumps(taken, indent=1, ensure_ascii=False, sort_keys=True) + "\n" if taken else ""
