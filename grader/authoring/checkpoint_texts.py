"""Make the texts of the files that each notebook adds, and pack them for the students' kit.

The solutions live once, in solution_pkg. Two files look different at an earlier checkpoint: edits below make that
version out of the solution. The files that the course gives live in the notebooks' sources.
"""

from __future__ import annotations

import json
import re
import zlib
from functools import cache
from typing import Any

import yaml

from grader.authoring import notebook_source
from grader.errors import GraderError
from grader.notebook import checkpoints, pieces
from grader.notebook.workspace import course
from grader.scoring import rubric
from grader.yaml_reader import FAST_LOADER

Edit = tuple[str, str]
"""A text that the solution holds once, and its replacement."""


def texts(notebook: str) -> dict[str, Any]:
    """Return the text of every file that a notebook ("05") adds or replaces, solved; for a case ("C3") its patient.

    Raises:
        GraderError: jupytext is missing, or an edit no longer fits the solution.
    """
    if notebook in cases():
        return patient(notebook)
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
    edits = tuple((row["old"], row["new"]) for row in rows)
    return edited((course().solution / path).read_text(encoding="utf-8"), edits, path)


def edited(text: str, edits: tuple[Edit, ...], path: str) -> str:
    """Return the text of the file `path` with the edits made.

    Raises:
        GraderError: the solution has changed, and an edit has not.
    """
    for old, new in edits:
        if (count := text.count(old)) != 1:
            raise GraderError(f"An edit of {path} fits the solution {count} times, not once: {old!r}")
        text = text.replace(old, new)
    return text


def given_texts(notebook: str) -> dict[str, str]:
    """Return the files that a notebook gives, as the cells of its source write them."""
    (name,) = notebook_source.select([notebook], course().notebooks)
    return dict(_given_texts(name, (course().notebooks / "source" / f"{name}.py").stat().st_mtime_ns))


@cache
def _given_texts(name: str, _written: int) -> dict[str, str]:
    """Return the files that a notebook gives; to read the sources of all takes more than a second."""
    cells = notebook_source.read(name, rubric.load(course().rubric), course().notebooks).cells
    given = [cell for cell in cells if notebook_source.GIVEN in notebook_source.tags(cell)]
    return {path: notebook_source.body(cell) for cell in given if (path := notebook_source.written_file(cell))}


def course_texts() -> dict[str, str]:
    """Return the Python that the course has: the reference's, and what the notebooks give.

    Raises:
        GraderError: jupytext is missing.
    """
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
    ill = {case: each for case in cases() if last.isdisjoint((each := patient(case))["files"])}
    return zlib.compress(json.dumps(found | ill).encode(), level=9)


# -- the clinic --------------------------------------------------------------------------------------------------------


def cases() -> dict[str, Any]:
    """Return the cases of the clinic ("C3"), each with the edits that make the solution ill."""
    path = course().path("patients/edits.yaml")
    return dict(yaml.load(path.read_text(encoding="utf-8"), FAST_LOADER)) if path.is_file() else {}


def patient(case: str) -> dict[str, Any]:
    """Return the texts that a case has in place of the solution's, in the source and installed, and the faulty lines.

    Raises:
        GraderError: an edit no longer fits the solution.
    """
    ill: dict[str, Any] = {"source": {}, "installed": {}}
    where = []
    for kind, folder in (("source", ""), ("installed", "site-packages/")):
        for path, rows in cases()[case].get(kind, {}).items():
            well = (course().solution / path).read_text(encoding="utf-8")
            ill[kind][path] = text = edited(well, tuple((row["old"], row["new"]) for row in rows), path)
            for new in (row["new"] for row in rows if not row.get("innocent")):
                first = text[: text.index(new)].count("\n") + 1
                where.append((folder + path, first, first + new.rstrip("\n").count("\n")))
    # Its interfaces are in the install tree, so `colcon build` takes seconds.
    return {"files": {"CMakeLists.txt": solution("01", "CMakeLists.txt")} | ill["source"],
            "installed": ill["installed"], "where": where}  # fmt: skip


def answer(cell: str) -> str:
    """Return a cell of the clinic, which names its case, with the diagnosis or the cure."""
    case = re.findall(r"\bC\d+\b", cell)[0]
    ill = patient(case)
    if cell.startswith("diagnosis"):
        path, first, _ = ill["where"][0]
        return f'diagnosis = "{path}:{first}"  # {case}'
    if "cure" in cases()[case]:
        return str(cases()[case]["cure"])
    (path,) = set(ill["files"]) - {"CMakeLists.txt"}
    well = solution("10", path)
    before = {found.name: ill["files"][path].splitlines()[found.start : found.end]
              for found in pieces.definitions(ill["files"][path])}  # fmt: skip
    lines, owner = [f"%%{pieces.MAGIC} {path}"], ""
    for found in pieces.definitions(well):
        text, of = well.splitlines()[found.start : found.end], found.name.rpartition(".")[0]
        if text != before.get(found.name):
            lines += ([f"class {of}:"] if of != owner else [""] if len(lines) > 1 else []) + text
            owner = of
    return "\n".join(lines)
