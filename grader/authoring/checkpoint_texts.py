"""Make the texts of the files that each notebook adds, and pack them for the students' kit.

The solutions live once, in solution_pkg. Two files look different at an earlier checkpoint: edits below make that
version out of the solution. The files that the course gives live in the notebooks' sources.
"""

from __future__ import annotations

import json
import zlib
from collections.abc import Iterable, Mapping
from types import ModuleType
from typing import Any

from grader.authoring import notebook_source
from grader.course.reader import modules
from grader.errors import GraderError
from grader.notebook import checkpoints
from grader.notebook.workspace import course
from grader.scoring import rubric


def texts(notebook: str) -> dict[str, Any]:
    """Return the text of every file that a notebook ("05") adds or replaces, solved; for a case ("C3") its patient.

    Raises:
        GraderError: an edit no longer fits the solution.
    """
    for clinic in clinics():
        if notebook in clinic.cases():
            return dict(clinic.patient(notebook))
    files = checkpoints.checkpoint(notebook)
    given = given_texts(notebook) if files.given else {}
    solved = {path: solution(notebook, path) for path in (*files.exercises, *files.made, *files.optional)}
    return {path: given[path] for path in files.given} | solved


def solution(notebook: str, path: str) -> str:
    """Return the text that an exercise of a notebook ("05") asks for.

    Raises:
        GraderError: an edit no longer fits the solution.
    """
    rows = course().notebook_table["edits"].get(checkpoints.number(notebook), {}).get(path, ())
    return edited((course().solution / path).read_text(encoding="utf-8"), rows, path)


def edited(text: str, edits: Iterable[Mapping[str, str]], path: str) -> str:
    """Return the text of the file `path` with the edits made: `old`, which it holds once, becomes `new`.

    Raises:
        GraderError: the solution has changed, and an edit has not.
    """
    for old, new in ((edit["old"], edit["new"]) for edit in edits):
        if (count := text.count(old)) != 1:
            raise GraderError(f"An edit of {path} fits the solution {count} times, not once: {old!r}")
        text = text.replace(old, new)
    return text


def given_texts(notebook: str) -> dict[str, str]:
    """Return the files that a notebook gives, as the cells of its source write them."""
    (name,) = notebook_source.select([notebook], course().notebooks)
    cells = notebook_source.read(name, rubric.load(course().rubric), course().notebooks).cells
    given = [cell for cell in cells if notebook_source.GIVEN in notebook_source.tags(cell)]
    return {path: notebook_source.body(cell) for cell in given if (path := notebook_source.written_file(cell))}


def course_texts() -> dict[str, str]:
    """Return the Python that the course has: the reference's, and what the notebooks give."""
    reference = course().solution
    found = {str(path.relative_to(reference)): path.read_text(encoding="utf-8") for path in reference.rglob("*.py")}
    for notebook in checkpoints.table():
        if checkpoints.checkpoint(notebook).given:
            found |= {f"{notebook}/{path}": text for path, text in given_texts(notebook).items()}
    return found


def packed() -> list[str]:
    """Return the notebooks ("05") whose texts students get: those before another one, which `start_at` lays out."""
    return sorted(map(checkpoints.number, checkpoints.table()))[:-1]


def pack() -> bytes:
    """Return the texts that students get as checkpoints.PACKED holds them; of the last notebook there is none."""
    found = {notebook: texts(notebook) for notebook in packed()}
    numbers = sorted(map(checkpoints.number, checkpoints.table()))
    last = {path for each in numbers[-1:] for path in texts(each)}
    ill = {case: texts(case) for clinic in clinics() for case in clinic.cases()}
    found |= {case: each for case, each in ill.items() if last.isdisjoint(each["files"])}
    return zlib.compress(json.dumps(found).encode(), level=9)


def clinics() -> list[ModuleType]:
    """Return the modules of a course that make its patients ill and well; most courses have none."""
    return modules(course().path("patients"))
