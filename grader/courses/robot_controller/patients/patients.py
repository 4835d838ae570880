"""Make the patients of the clinic out of the solution, and their cures. Not released, as edits.yaml is not."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import yaml

from grader.authoring import checkpoint_texts
from grader.notebook import pieces
from grader.notebook.workspace import course
from grader.yaml_reader import FAST_LOADER

HUNTED = "H"
"""How the names begin of packages that are not treated: `hunt` finds what is wrong with them."""


def cases() -> dict[str, Any]:
    """Return the cases of the clinic ("C3"), each with the edits that make the solution ill."""
    path = Path(__file__).with_name("edits.yaml")
    return dict(yaml.load(path.read_text(encoding="utf-8"), FAST_LOADER))


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
            ill[kind][path] = text = checkpoint_texts.edited(well, rows, path)
            for new in (row["new"] for row in rows if not row.get("innocent")):
                first = text[: text.index(new)].count("\n") + 1
                where.append((folder + path, first, first + new.rstrip("\n").count("\n")))
    # What is treated has its interfaces in the install tree, so that `colcon build` takes seconds.
    builds = {} if case.startswith(HUNTED) else {"CMakeLists.txt": checkpoint_texts.solution("01", "CMakeLists.txt")}
    return {"files": builds | ill["source"], "installed": ill["installed"], "where": where}


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
    well = checkpoint_texts.solution("10", path)
    before = {found.name: ill["files"][path].splitlines()[found.start : found.end]
              for found in pieces.definitions(ill["files"][path])}  # fmt: skip
    lines, owner = [f"%%{pieces.MAGIC} {path}"], ""
    for found in pieces.definitions(well):
        text, of = well.splitlines()[found.start : found.end], found.name.rpartition(".")[0]
        if text != before.get(found.name):
            lines += ([f"class {of}:"] if of != owner else [""] if len(lines) > 1 else []) + text
            owner = of
    return "\n".join(lines)
