"""Read a notebook's source, notebooks/source/NN_topic.py (jupytext, py:percent). Runs nothing.

`exercise`, `skeleton` and `given` cells are whole files of the package (`%%writefile PATH`), `piece` cells fill
functions of a skeleton (`%%into PATH`), `check` cells call the grader. Ids are made from the section and the cell's
position in it, so a new cell renames only the cells after it in its own section.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from functools import lru_cache
from pathlib import Path
from typing import Any

import nbformat
from nbformat import NotebookNode

from grader import KIT
from grader.errors import GraderError
from grader.notebook import last_hint, pieces
from grader.scoring.rubric import Rubric

NOTEBOOKS = KIT / "notebooks"
EXERCISE, SKELETON, PIECE, GIVEN, CHECK = "exercise", "skeleton", "piece", "given", "check"
FUNCTION = "function"  # a function that stays in the notebook; solution_NN.py beside the source has it solved
UNSEEN = "unseen"  # beside `function`: a task without hints or a table, which only its check judges
CASE = "case"  # the diagnosis or the cure of a patient of the clinic, which the cell names
FOLDED_LINES = 40  # about a screen: a whole file that is longer is folded, to be opened by those who want to read it
DESIGN = "design"  # a piece of which learners decide how it works: without a last hint, with two designs afterwards

_NAME = re.compile(r"\d\d_\w+")
_WRITES = re.compile(r"%%writefile +(\S+) *\n?")
_INTO = re.compile(rf"%%{pieces.MAGIC} +(\S+) *\n")
_CALL = re.compile(r"\bcheck\(([^)]*)\)")
_EXERCISES = {EXERCISE, PIECE, FUNCTION}
_TRY = re.compile(rf"^ *(?:tries|check|mutant_matrix)\(|{last_hint.PYTEST.pattern}", re.MULTILINE)
_MAX_ID = 64  # characters of a cell's id, by the notebook format


def functions(name: str, notebooks: Path = NOTEBOOKS) -> str:
    """Return the text of the module with the solved functions that stay in the notebook `name`."""
    return (notebooks / "source" / f"solution_{name[:2]}.py").read_text(encoding="utf-8")


def names(notebooks: Path = NOTEBOOKS) -> list[str]:
    """Return the names of the notebooks that have a source, such as "05_moving_safely", in the course's order."""
    return sorted(path.stem for path in (notebooks / "source").glob("*.py") if _NAME.fullmatch(path.stem))


def select(numbers: Iterable[str], notebooks: Path = NOTEBOOKS) -> list[str]:
    """Return the notebooks with one of `numbers` ("05", or a whole name); all notebooks if `numbers` is empty.

    Raises:
        GraderError: there is no such notebook.
    """
    known = {short: name for name in names(notebooks) for short in (name, name.partition("_")[0])}
    wanted = list(numbers)
    for number in wanted:
        if number not in known:
            raise GraderError(f"There is no notebook {number}; there are {', '.join(names(notebooks)) or 'none yet'}.")
    return sorted({known[number] for number in wanted or known})


def read(name: str, rubric: Rubric, notebooks: Path = NOTEBOOKS) -> NotebookNode:
    """Return the notebook `name` as its source defines it: cells with ids and nbgrader metadata, without outputs.

    Raises:
        GraderError: the source is not a valid notebook.
    """
    source = notebooks / "source" / f"{name}.py"
    raw = _parsed(source.read_text(encoding="utf-8"))
    notebook = nbformat.v4.new_notebook(
        cells=[_cell(cell) for cell in raw.cells if cell.source.strip()],
        metadata=metadata(),
    )
    _name_cells(notebook)
    _add_nbgrader_metadata(name, notebook, rubric, notebooks)
    try:
        nbformat.validate(notebook)
    except nbformat.ValidationError as error:
        raise GraderError(f"{source.name} is not a valid notebook: {error}") from error
    return notebook


@lru_cache(32)
def _parsed(text: str) -> NotebookNode:
    """Return what jupytext makes of a source: a quarter of a second, and a release reads each of them several times."""
    import jupytext

    return jupytext.reads(text, fmt={"extension": ".py", "format_name": "percent", "comment_magics": False})


def _uncommented(source: str) -> str:
    """Return a code cell with its magics, which are comments in a source; a whole file keeps all but the first."""
    return re.sub(r"(?m)^( *)# ?(?=[!%])", r"\1", source, count=source.startswith("# %%writefile"))


def metadata() -> NotebookNode:
    """Return the metadata of every notebook: language and kernel, without versions."""
    kernel = {"display_name": "Python 3 (ipykernel)", "language": "python", "name": "python3"}
    return nbformat.from_dict({"kernelspec": kernel, "language_info": {"name": "python"}})


def _cell(raw: NotebookNode) -> NotebookNode:
    """Return the cell with its tags, without the notes of jupytext and editors; a long file is folded in JupyterLab."""
    tags: dict[str, Any] = {"tags": list(raw.metadata["tags"])} if raw.metadata.get("tags") else {}
    if raw.cell_type == "code" and lines(raw) > FOLDED_LINES and {GIVEN, SKELETON} & set(tags.get("tags", ())):
        tags["jupyter"] = {"source_hidden": True}
    if raw.cell_type == "code":
        return nbformat.v4.new_code_cell(_uncommented(raw.source), metadata=tags)
    return nbformat.v4.new_markdown_cell(raw.source, metadata=tags)


def _name_cells(notebook: NotebookNode) -> None:
    taken: set[str] = set()
    section, position = "start", 0
    for cell in notebook.cells:
        for level, heading in headings(cell):
            if level == 2:
                section, position = _slug(heading), 0
        position += 1
        if file := written_file(cell):
            wanted = f"file-{_slug(file)}"
        elif file := piece_file(cell):
            functions = pieces.definitions(body(cell))
            wanted = f"piece-{_slug(file.rpartition('/')[2])}-{_slug(' '.join(f.name for f in functions))}"
        elif CHECK in tags(cell) and checked(cell):
            wanted = f"check-{_slug(' '.join(checked(cell)))}"
        else:
            wanted = f"{section[: _MAX_ID - 4]}-{position:02d}"
        name, again = wanted[:_MAX_ID], 1
        while name in taken:
            again += 1
            name = f"{wanted[: _MAX_ID - 3]}-{again}"
        taken.add(name)
        cell["id"] = name


def _slug(text: str) -> str:
    return re.sub(r"[^a-z0-9]+", "-", text.lower()).strip("-") or "section"


def scored_requirements(name: str, notebook: NotebookNode, notebooks: Path = NOTEBOOKS) -> dict[str, list[str]]:
    """Return the requirements that each check cell scores, by the cell's id.

    Only the last check of a requirement in the course scores it: earlier the package is incomplete.
    """
    last = {asked: source for source in names(notebooks) for asked in _asked(notebooks / "source" / f"{source}.py")}
    taken: set[str] = set()
    found = {}
    for cell in reversed(check_cells(notebook)):
        here = [asked for asked in checked(cell) if last.get(asked) == name and asked not in taken]
        taken |= set(here)
        found[str(cell["id"])] = here
    return found


def _asked(source: Path) -> list[str]:
    lines = [line for line in source.read_text(encoding="utf-8").splitlines() if line.startswith("check(")]
    return _requirements("\n".join(lines))


def _add_nbgrader_metadata(name: str, notebook: NotebookNode, rubric: Rubric, notebooks: Path) -> None:
    """Add the metadata from which nbgrader knows which cells to lock and which to grade."""
    worth = {requirement.id: requirement.points for requirement in rubric.requirements}
    scored = scored_requirements(name, notebook, notebooks)
    for cell in notebook.cells:
        kind = {EXERCISE, SKELETON, PIECE, GIVEN, CHECK} & set(tags(cell))
        if not kind:
            continue
        points = sum(worth.get(asked, 0.0) for asked in scored.get(cell["id"], []))
        added: dict[str, Any] = {
            "schema_version": 3, "grade_id": cell["id"], "task": False,
            "grade": points > 0, "solution": not kind & {GIVEN, CHECK}, "locked": bool(kind & {GIVEN, CHECK}),
        }  # fmt: skip
        cell.metadata["nbgrader"] = added | ({"points": points} if points else {})


def lines(cell: NotebookNode) -> int:
    """Return how many lines of the cell are not blank."""
    return sum(bool(line.strip()) for line in cell.source.splitlines())


def tags(cell: NotebookNode) -> list[str]:
    """Return the cell's tags."""
    return list(cell.metadata.get("tags", []))


def check_cells(notebook: NotebookNode) -> list[NotebookNode]:
    """Return the cells that call `check`."""
    return [cell for cell in notebook.cells if CHECK in tags(cell)]


def headings(cell: NotebookNode) -> Iterator[tuple[int, str]]:
    """Yield the headings of a markdown cell with their levels, 1 for the title; a `#` in a fenced block is not one."""
    if cell.cell_type != "markdown":
        return
    fenced = False
    for line in cell.source.splitlines():
        if line.lstrip().startswith(("```", "~~~")):
            fenced = not fenced
        elif not fenced and (match := re.match(r"(#{1,6}) +(.+?) *#*$", line)):
            yield len(match[1]), match[2]


def written_file(cell: NotebookNode) -> str | None:
    """Return the path in the package that an exercise, skeleton or given cell writes, None for other cells."""
    if not {EXERCISE, SKELETON, GIVEN} & set(tags(cell)):
        return None
    match = _WRITES.match(cell.source)
    return match[1] if match else None


def piece_file(cell: NotebookNode) -> str | None:
    """Return the path in the package of the file that a piece fills, None for other cells."""
    match = _INTO.match(cell.source) if PIECE in tags(cell) else None
    return match[1] if match else None


def body(cell: NotebookNode) -> str:
    """Return the text that the cell writes to its file, or into it; IPython ends it with a line break."""
    text = _INTO.sub("", _WRITES.sub("", cell.source, count=1), count=1)
    return text if text.endswith("\n") else text + "\n"


def with_body(cell: NotebookNode, text: str) -> str:
    """Return the cell's source with `text` as the text of its file."""
    return cell.source.partition("\n")[0] + "\n" + text.rstrip("\n")


def checked(cell: NotebookNode) -> list[str]:
    """Return the requirements that a cell's `check(...)` asks for, in its order."""
    return _requirements(cell.source)


def _requirements(source: str) -> list[str]:
    return [name for call in _CALL.findall(source) for name in re.findall(r"[\"'](\w+)[\"']", call)]


def take_out_hints(notebook: NotebookNode) -> dict[str, str]:
    """Replace the last hints on a notebook's pages, in place, and return them by what their exercises write.

    A hint is about the exercises above it, up to the hint before or a heading. One stays on its page if no exercise is
    there, or nothing tries that exercise before the next one.

    Raises:
        GraderError: two exercises with different hints write the same function.
    """
    found: dict[str, str] = {}
    above: list[NotebookNode] = []
    for cell in notebook.cells:
        if _EXERCISES & {*tags(cell)}:
            above.append(cell)
        elif cell.cell_type == "markdown" and (fold := last_hint.FOLD.search(cell.source)):
            about = above if above and _is_tried(notebook, above[-1]) else []
            names = [name for each in about for name in last_hint.written(each.source)]
            for name in names:
                if found.setdefault(name, fold[0]) != fold[0]:
                    raise GraderError(f"Two exercises with different last hints write {name}.")
            if names:
                cell.source = last_hint.FOLD.sub(rf"\1\n\n{last_hint.PLACE}\n\3", cell.source, count=1)
            above = []
        if any(True for _ in headings(cell)):
            above = []
    return found


def _is_tried(notebook: NotebookNode, exercise: NotebookNode) -> bool:
    """Return whether a cell before the next exercise tries this one."""
    for cell in notebook.cells[notebook.cells.index(exercise) + 1 :]:
        if _EXERCISES & {*tags(cell)}:
            return False
        if cell.cell_type == "code" and _TRY.search(cell.source):
            return True
    return False
