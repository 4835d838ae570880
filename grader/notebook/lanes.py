"""The lanes through the course: which one a workspace is in, what the course gives in it, and how a notebook looks.

A cell tagged `whole` is left out of every shorter lane. In one of those the course writes what such cells would have
written, never over a learner's own text, and `fold` puts each run of them into one cell that is closed. Where a lane
has a frame for an exercise, its cell has more in it than the whole lane's.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from contextlib import suppress
from itertools import groupby
from pathlib import Path
from textwrap import shorten
from typing import Any

from grader.errors import GraderError
from grader.intake import course_marker
from grader.notebook import checkpoints, pieces
from grader.notebook.feedback import in_a_kernel
from grader.notebook.file_backups import FORCE, FileBackups
from grader.notebook.workspace import Workspace, course
from grader.python_ast import UNPARSABLE
from grader.words import counted, mark, say, some

WHOLE = "whole"
"""The lane that leaves nothing out, and the tag of the cells that it alone has."""
FILE = ".lane"
"""The file of the workspace that names its lane."""
_LINE = 90  # characters of the line that says what a folded run of cells does
_HEADING = r"(?m)^#{2,6} +(.+)$"


def table() -> Mapping[str, Any]:
    """Return the course's lanes by name, each with its minutes, and what it gives and asks for; most have none."""
    found: Mapping[str, Any] = course().notebook_table["lanes"]
    return found


def require(lane: str) -> str:
    """Return the name of a lane.

    Raises:
        ValueError: the course has no such lane.
    """
    if lane not in table():
        words = mark("There is no lane {lane!r}; there are {known}.")
        raise ValueError(say(words, lane=lane, known=", ".join(table()) or say("none in this course")))
    return lane


def _part(lane: str, name: str) -> Any:
    return table().get(lane, {}).get(name, {})


def minutes(lane: str) -> Mapping[str, tuple[int, int]]:
    """Return how many minutes each notebook ("05") takes in a lane, from and to."""
    return {notebook: (first, last) for notebook, (first, last) in _part(lane, "minutes").items()}


def asked_for(lane: str) -> tuple[str, ...]:
    """Return the requirements that a lane asks for; () stands for all of them."""
    return tuple(table()[require(lane)].get("asks", ()))


def asked_later(lane: str) -> Mapping[str, str]:
    """Return the notebook ("07") that asks for what a shorter lane leaves out of the one that teaches it."""
    stand_ins = course().notebook_table["stand_ins"] if asked_for(lane) else {}
    found = {name: str(row["notebook"]) for name, row in stand_ins.items()}
    return found | dict(_part(lane, "later"))


def given(lane: str, notebook: str) -> Mapping[str, list[str]]:
    """Return the files that the course gives in a lane in place of a notebook's cells, and the functions of each.

    Without functions it is the whole file.
    """
    found: Mapping[str, list[str]] = _part(lane, "gives").get(notebook, {})
    return found


def of(workspace: Workspace) -> str:
    """Return the lane of a workspace, "" if none was chosen."""
    path = workspace.root / FILE
    kept = path.read_text(encoding="utf-8").strip() if path.is_file() else ""
    return kept if kept in table() else ""


def choose(workspace: Workspace, notebook: str, lane: str = "") -> str:
    """Keep the lane that is given, or that is answered to the question which one; return a line to print, or "".

    The question comes once, where a notebook's length depends on it, and only where somebody can answer.

    Raises:
        ValueError: the course has no such lane.
    """
    before = of(workspace)
    if not lane and (before or notebook not in minutes(WHOLE)):
        return ""
    lane = lane or _answer()
    if not lane:
        words = mark('Lane: {lane}. begin("{notebook}", lane=...) takes another: {known}.')
        return say(words, lane=WHOLE, notebook=notebook, known=_described())
    keep(workspace, lane)
    return write_folded(workspace.root.parent / "notebooks", lane) if lane not in (before, WHOLE) else ""


def keep(workspace: Workspace, lane: str) -> None:
    """Put a workspace in a lane.

    Raises:
        ValueError: the course has no such lane.
    """
    workspace.root.mkdir(parents=True, exist_ok=True)
    (workspace.root / FILE).write_text(require(lane) + "\n", encoding="utf-8")


def _described() -> str:
    hours = {lane: [round(sum(each) / 60) for each in zip(*minutes(lane).values(), strict=True)] for lane in table()}
    words = mark("{lane} ({first} to {last} hours)")
    return ", ".join(say(words, lane=lane, first=first, last=last) for lane, (first, last) in hours.items())


def _answer() -> str:
    """Ask for the lane, and return it; "" where nobody can answer."""
    if not in_a_kernel():
        return ""
    question = say("Which lane do you take: {known}? Type its name, and Enter: ", known=_described())
    with suppress(EOFError, RuntimeError):  # the kernel's way to say that its front end cannot ask
        while (answer := input(question).strip() or WHOLE) not in table():
            pass
        return answer
    return ""


# -- what the course gives ---------------------------------------------------------------------------------------------


def lay_out(workspace: Workspace, notebook: str) -> str:
    """Write what the workspace's lane gives in a notebook, never over a learner's own text; return what that is."""
    lane = of(workspace)
    wanted = given(lane, notebook)
    if not wanted:
        return say("Lane: {lane}.", lane=lane) if lane and lane != WHOLE else ""
    try:
        texts = checkpoints.texts(notebook)
    except GraderError as error:
        return say("lane {lane}: {error}", lane=lane, error=error)
    wanted = {path: functions for path, functions in wanted.items() if path in texts}  # none of the last notebook's
    for path, functions in wanted.items():
        if functions:
            fill(workspace, notebook, workspace.package / path)
        else:
            _write(workspace, notebook, path, texts[path])
    places = {path: path.removeprefix(f"{course().package}/") for path in wanted}
    names = [f"{places[path]} ({', '.join(each)})" if each else places[path] for path, each in wanted.items()]
    return say("Lane: {lane}. The course gives in this notebook: {names}.", lane=lane, names="; ".join(names))


def _write(workspace: Workspace, notebook: str, path: str, text: str) -> None:
    """Write a whole file, unless there is one already that is not as an earlier notebook gave it."""
    target, backups = workspace.package / path, FileBackups(workspace)
    if target.exists() and target.read_text(encoding="utf-8", errors="replace") != text:
        before = {writer for writer in backups.writers(target) if writer < notebook}
        if not any(path in checkpoints.checkpoint(writer).given for writer in before):
            return
    checkpoints.write_files(workspace.package, {path: text})
    backups.note(target, notebook, "writefile")
    if path not in checkpoints.checkpoint(notebook).given:
        course_marker.add(workspace.package, files={path: text})


def fill(workspace: Workspace, notebook: str, target: Path) -> None:
    """Put the functions that the lane gives into a file that a cell has written, where they are as that cell left them.

    Called after a cell of the notebook has written a file, and by `begin`.
    """
    backups = FileBackups(workspace)
    path = backups.name(target)
    wanted = set(given(of(workspace), notebook).get(path, ()))
    skeleton = backups.left(target, notebook, "writefile")
    if not wanted or not skeleton or not target.is_file():
        return
    try:
        solution, text = checkpoints.texts(notebook)[path], target.read_text(encoding="utf-8")
        left, now = pieces.functions(skeleton), pieces.functions(text)
        stubs = {name for name in wanted if name in now and now[name] == left.get(name)}
        filled = pieces.filled(text, solution, stubs) + "\n"
    except (GraderError, KeyError, *UNPARSABLE):  # without the solution, or with a learner's slip in the file
        return
    magic = "writefile" if text == skeleton else pieces.MAGIC
    if filled != text:
        target.write_text(filled, encoding="utf-8")
        backups.note(target, notebook, magic)
    if stubs:
        course_marker.add(workspace.package, named={path: (solution, stubs)})


def refusal(workspace: Workspace, notebook: str, magic: str, target: Path | None, line: str, cell: str) -> str:
    """Return why a cell must not write: it would replace what the lane gives; "" if it may."""
    path = FileBackups(workspace).name(target) if target is not None else ""
    lane, package = of(workspace), workspace.package
    functions = given(lane, notebook).get(path)
    if functions is None or target is None or not target.is_file() or FORCE in line.split():
        return ""
    if functions:
        found = course_marker.unchanged_functions(package) if magic == pieces.MAGIC else ()
        names = [name for name in course_marker.functions(cell) if f"{target.name} {name}" in found]
    else:
        is_given = path in course_marker.unchanged(package) and cell.encode() != target.read_bytes()
        names = [target.name] if is_given else []
    if not names:
        return ""
    words = mark(
        "Nothing was written: your lane, {lane}, gives {names}. To write it yourself, begin the cell with "
        "%%{magic} {force}."
    )
    return say(words, lane=lane, names=some(names, len(names)), magic=magic, force=FORCE)


# -- how a notebook looks ----------------------------------------------------------------------------------------------


def fold(notebook: Any, number: str, lane: str) -> Any:
    """Return a notebook ("05") for a lane, as nbformat reads it: what the lane leaves out is folded and does not run.

    A run of such cells becomes one Markdown cell, closed, with a line about what they do: so they fold on every page
    that shows notebooks, "Run All" passes over them, and nothing is lost.
    """
    from nbformat.v4 import new_markdown_cell

    cells = [cell for run in _runs(notebook["cells"]) for cell in run]
    first, last = minutes(lane)[number]
    note = (
        f"> **The {lane} lane: {first} to {last} minutes.** What is folded below belongs to the whole lane; "
        f"the course gives what you need of it later. Exercises and steps have the whole lane's numbers."
    )
    cells.insert(1, new_markdown_cell(note, id=f"lane-{lane}"))
    for cell in cells:
        if cell["cell_type"] == "code":
            source = re.sub(rf'\bbegin\("{number}"\)', f'begin("{number}", lane="{lane}")', cell["source"])
            cell["source"] = _framed(_with_given(source, number, lane), frames(lane, number).get(cell["id"], ""))
    notebook["cells"] = cells
    return notebook


def frames(lane: str, notebook: str) -> Mapping[str, str]:
    """Return what a lane has in the cells of a notebook's exercises in place of their stubs, by the cells' ids."""
    found: Mapping[str, str] = _part(lane, "frames").get(notebook, {})
    return found


def _framed(source: str, frame: str) -> str:
    """Return an exercise's cell with a lane's frame below its first line; one that is solved stays as it is."""
    return f"{source.partition(chr(10))[0]}\n{frame.rstrip()}" if frame and "TODO" in source else source


def _with_given(source: str, number: str, lane: str) -> str:
    """Return a skeleton's cell, in which the functions that the lane gives say so at their ends."""
    magic, _, text = source.partition("\n")
    names = [name for path, each in given(lane, number).items() if magic == f"%%writefile {path}" for name in each]
    lines = text.splitlines()
    for found in pieces.definitions(text) if names else ():
        if found.name in names:
            last = re.sub(r"  # .*$", "", lines[found.end - 1])
            lines[found.end - 1] = f"{last}  # the {lane} lane fills it in when the cell runs"
    return "\n".join([magic, *lines]) if names else source


def write_folded(notebooks: Path, lane: str) -> str:
    """Write a folded copy of each notebook in a folder beside it, and return in words which to open, "" if none.

    One that is there stays as it is. In a kit for the lane the notebooks are folded themselves.
    """
    import nbformat

    written = ""
    for path in sorted(notebooks.glob("[0-9][0-9]_*.ipynb")):
        copy = path.with_suffix(f".{lane}.ipynb")
        if path.name.count(".") > 1 or path.name[:2] not in minutes(lane) or copy.exists():
            continue
        notebook = nbformat.read(path, as_version=4)
        if f"lane-{lane}" not in [cell.get("id") for cell in notebook.cells]:
            text = nbformat.writes(fold(notebook, path.name[:2], lane))
            copy.write_text(re.sub(r"\((\d\d_\w+)\.ipynb\)", rf"(\1.{lane}.ipynb)", text), encoding="utf-8")
            written = written or copy.name
    words = mark("Open {written}, and so on: in them what the lane leaves out is folded.")
    return say(words, written=written) if written else ""


def _runs(cells: list[Any]) -> Iterator[list[Any]]:
    for left_out, run in groupby(cells, key=lambda cell: WHOLE in cell["metadata"].get("tags", ())):
        found = list(run)
        yield [_folded(found)] if left_out else found


def _folded(run: list[Any]) -> Any:
    """Return a run of cells as one, closed, with a line on what they do: their first headings, or how they begin."""
    from nbformat.v4 import new_markdown_cell

    texts, titles = [], []
    for cell in run:
        if cell["cell_type"] == "code":
            texts.append(f"````python\n{cell['source']}\n````")
        else:
            titles += re.findall(_HEADING, cell["source"])
            # A heading in there would be in the table of contents, and lead nowhere.
            texts.append(re.sub(_HEADING, r"**\1**", cell["source"]))
    begin = re.sub(r"<[^>]+>|[*`]", "", run[0]["source"].partition("</summary>")[0]).strip().partition("\n")[0]
    what = re.sub(r"`([^`]+)`", r"<code>\1</code>", "; ".join(titles[:3]) or shorten(begin, _LINE, placeholder=" ..."))
    summary = f"Whole lane, {counted(len(run), 'cell')}: {what}"
    source = "\n\n".join([f"<details><summary>{summary}</summary>", *texts, "</details>"])
    return new_markdown_cell(source, id=run[0]["id"], metadata={"tags": [WHOLE]})
