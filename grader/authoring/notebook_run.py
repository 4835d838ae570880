"""Run a notebook from top to bottom in a workspace of its own, as shipped or solved, and read its checks' answers.

`clean` takes out of its outputs what depends on the machine or the day, and makes its pictures small.
"""

from __future__ import annotations

import asyncio
import base64
import io
import os
import re
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from nbformat import NotebookNode
from PIL import Image

from grader import KIT
from grader.authoring import checkpoint_texts, notebook_source
from grader.intake import course_marker
from grader.notebook import checkpoints, lanes, pieces
from grader.notebook.standing import ALONE
from grader.notebook.workspace import FRESH, VARIABLE, Workspace
from grader.words import say

CELL_SECONDS = 600.0  # a cell that takes longer hangs; on a busy machine the tests of notebook 09 take minutes
_HELD_BACK = "is judged at hand-in"  # all that a check says of a requirement that is held back
_COLOURS = 128

Solutions = Callable[[str, str], str]
"""A function from a notebook and a path in the package to the solution's text of that file."""


@dataclass
class NotebookRun:
    """A notebook that was run, with its outputs; `error` is the exception that ended it early, if any."""

    notebook: NotebookNode
    seconds: float = 0.0
    error: str | None = None

    @property
    def answers(self) -> list[str]:
        """Return the first line of each answer of the checks, such as "F4 not yet (0 of 5)"."""
        return [line for cell in self.notebook.cells for line in answers(cell)]


def answers(cell: NotebookNode) -> list[str]:
    """Return the lines "F4 passed ...", "F4 not yet ..." and of what is held back in the outputs of a check cell."""
    wanted = notebook_source.checked(cell) if notebook_source.CHECK in notebook_source.tags(cell) else []
    if not wanted:
        return []
    text = "\n".join(plain_text(output) for output in cell.get("outputs", []))
    known = "|".join(map(re.escape, wanted))
    line = re.compile(rf"^ *(?:{known}) +(?:passed\b|not yet\b|{_HELD_BACK}).*$", re.MULTILINE)
    return [match[0].strip() for match in line.finditer(text)]


def plain_text(output: NotebookNode) -> str:
    """Return an output's plain text."""
    return str(output.get("text") or output.get("data", {}).get("text/plain", ""))


def execute(notebook: NotebookNode, workspace: Path, kit: Path = KIT) -> NotebookRun:
    """Run the notebook in `workspace` (created if it is missing) and return it with its outputs.

    The kernel runs in this Python, in an empty folder, so that nothing is written into the kit.
    """
    from nbclient import NotebookClient
    from nbclient.exceptions import CellExecutionError

    run = NotebookRun(notebook)
    with tempfile.TemporaryDirectory(prefix="notebook-") as folder:
        client = NotebookClient(
            notebook,
            timeout=CELL_SECONDS,
            startup_timeout=CELL_SECONDS,  # nbclient gives a kernel a minute, which a busy machine may need to import
            kernel_name="python3",
            record_timing=False,
            coalesce_streams=True,  # into how many pieces they come depends on timing
            store_widget_state=False,
            resources={"metadata": {"path": folder}},
        )
        started = time.monotonic()
        try:
            # An event loop that is closed at the end: the one that nbclient would create stays open.
            asyncio.run(client.async_execute(env=environment(workspace, kit)))
        except CellExecutionError as error:
            ids = [c["id"] for c in notebook.cells for out in c.get("outputs", []) if out.output_type == "error"]
            # Without the colours meant for a notebook.
            run.error = f"cell {next(iter(ids), '?')}:\n" + re.sub(r"\x1b\[[0-9;]*m", "", str(error))
        except (TimeoutError, RuntimeError) as error:  # a cell that hangs, a kernel that dies
            run.error = f"{type(error).__name__}: {error}"
        run.seconds = time.monotonic() - started
    return run


# Where nobody watches, the picture of a live view would be that of its start.
_LIVE_VIEWS = """
import contextlib, sys, weakref

seen = weakref.WeakSet()

def let_it_run(_result):
    views = sys.modules.get("sim.live.view")
    for live in {*views.Live._shown.values()} - {*seen} if views else ():
        seen.add(live)
        if live.simulator.time == 0.0 and not live.is_running and not live.is_stopped:
            with contextlib.suppress(Exception):  # the view itself shows what a driver raises
                live.run(10.0)

get_ipython().events.register("post_run_cell", let_it_run)
"""


def environment(workspace: Path, kit: Path = KIT) -> dict[str, str]:
    """Return the environment of a kernel whose workspace is `workspace`, with the `grader` and `sim` of `kit`.

    In that kernel each live view runs for ten simulated seconds after the cell that shows it.
    """
    workspace.mkdir(parents=True, exist_ok=True)
    startup = workspace.parent / "ipython" / "profile_default" / "startup"
    startup.mkdir(parents=True, exist_ok=True)
    (startup / "live_views.py").write_text(_LIVE_VIEWS)
    path = os.environ.get("PYTHONPATH", "").split(os.pathsep)
    # Not `os.environ | ...`: another thread may remove a variable in between, as pytest does with PYTEST_CURRENT_TEST.
    outer = {name: value for name in list(os.environ) if (value := os.environ.get(name)) is not None}
    return outer | {
        VARIABLE: str(workspace),
        FRESH: "1",
        ALONE: "1",
        "PYTHONPATH": os.pathsep.join([str(kit), *filter(None, path)]),
        "IPYTHONDIR": str(workspace.parent / "ipython"),
        "PYDEVD_DISABLE_FILE_VALIDATION": "1",  # or the debugger prints a warning in each kernel
    }


def solved(name: str, notebook: NotebookNode, solutions: Solutions) -> NotebookNode:
    """Return the notebook with the solution in each exercise, and in each piece of a skeleton."""
    for cell in notebook.cells:
        if path := notebook_source.piece_file(cell):
            cell.source = notebook_source.with_body(
                cell, pieces.filled(notebook_source.body(cell), solutions(name, path))
            )
        if notebook_source.EXERCISE in notebook_source.tags(cell) and (path := notebook_source.written_file(cell)):
            cell.source = notebook_source.with_body(cell, solutions(name, path))
        if notebook_source.FUNCTION in notebook_source.tags(cell):
            cell.source = pieces.filled(cell.source, notebook_source.functions(name))
        if notebook_source.CASE in notebook_source.tags(cell):
            cell.source = checkpoint_texts.clinics()[0].answer(cell.source)
    return notebook


def lay_out(name: str, workspace: Path) -> None:
    """Write the package as a student leaves it who has worked through the notebooks before `name`."""
    opened = Workspace(workspace)
    checkpoints.start_at(opened, name)
    if lanes.table():
        lanes.keep(opened, lanes.WHOLE)
    (opened.package / course_marker.MARKER).unlink(missing_ok=True)


def solve(name: str, notebook: NotebookNode, workspace: Path) -> NotebookRun:
    """Run a notebook with solved exercises in a new workspace, after those before it; each of its checks must pass."""
    lay_out(name, workspace)
    run = execute(notebook, workspace)
    if run.error is None and (missing := answered_otherwise(run.notebook)):
        run.error = f"{name}: solved, but these checks do not pass: {', '.join(missing)}"
    if run.error is None and (wrong := cells_not_yet(run.notebook)):
        run.error = f"{name}: solved, but these tables of cases say NOT YET: {', '.join(wrong)}"
    return run


def cells_not_yet(notebook: NotebookNode) -> list[str]:
    """Return the cells whose table of cases has a row that is not right."""
    outputs = {cell["id"]: cell.get("outputs", []) for cell in notebook.cells}
    return [name for name, shown in outputs.items() if any(say("NOT YET") in plain_text(output) for output in shown)]


def answered_otherwise(notebook: NotebookNode, expected: str = "passed") -> list[str]:
    """Return the requirements that a check of the notebook did not answer with "passed", or "not yet"."""
    found = []
    right = re.compile(rf"\w+ +(?:{expected}\b|{_HELD_BACK})")
    for cell in notebook_source.check_cells(notebook):
        as_expected = {line.split()[0] for line in answers(cell) if right.match(line)}
        found += [name for name in notebook_source.checked(cell) if name not in as_expected]
    return found


def path_patterns(workspace: Path) -> list[tuple[str, str]]:
    """Return (pattern, replacement) for each trace of this machine in outputs, in the order of use."""
    return [
        (re.escape(str(workspace.resolve())), "ws"),
        (re.escape(str(workspace)), "ws"),
        (re.escape(str(Path(sys.prefix))), ".venv"),
        (re.escape(str(KIT)), "kit"),
        (r"/tmp/ipykernel_\d+/\d+\.py", "<cell>"),
        (r"\[\d{10}\.\d{9}\]", "[<time>]"),  # of a node's log
    ]


def without_paths(text: str, workspace: Path) -> str:
    """Return `text` with the paths of this machine replaced by names."""
    for pattern, replacement in path_patterns(workspace):
        text = re.sub(pattern, replacement, text)
    return text


def clean(notebook: NotebookNode, workspace: Path) -> None:
    """Clean the outputs of a notebook that was run in `workspace`, in place."""
    notebook.metadata = notebook_source.metadata()  # a kernel adds its version, widgets their state
    for cell in (cell for cell in notebook.cells if cell.cell_type == "code"):
        # A line about progress, which is empty at the end, leaves an empty output.
        cell.outputs = [output for output in cell.outputs if output.get("data") != {}]
        for output in cell.outputs:
            if output.output_type == "stream":
                output.text = without_paths(output.text, workspace)
            data = output.get("data", {})
            if "image/png" in data:  # the static picture of a widget: the widget needs a kernel, the picture does not
                data.pop("application/vnd.jupyter.widget-view+json", None)
            for kind, value in data.items():
                if isinstance(value, str):
                    data[kind] = small_png(value) if kind == "image/png" else without_paths(value, workspace)


def small_png(encoded: str) -> str:
    """Return a base64 PNG reduced to 128 colours if that makes it smaller: plots have few colours. A film stays."""
    raw = base64.b64decode(encoded)
    with Image.open(io.BytesIO(raw)) as opened:
        if getattr(opened, "is_animated", False):
            return encoded
    smaller = reduce_colours(raw)
    return base64.b64encode(smaller).decode() if len(smaller) < len(raw) else encoded


def reduce_colours(png: bytes, max_width: int | None = None) -> bytes:
    """Return a PNG with a palette of 128 colours on white, no wider than `max_width` pixels."""
    with Image.open(io.BytesIO(png)) as opened:
        picture = opened.convert("RGBA")
    flat = Image.new("RGBA", picture.size, "white")
    flat.alpha_composite(picture)
    image = flat.convert("RGB")
    if max_width is not None and image.width > max_width:
        image = image.resize((max_width, round(image.height * max_width / image.width)), Image.Resampling.LANCZOS)
    stream = io.BytesIO()
    image.quantize(_COLOURS, dither=Image.Dither.NONE).save(stream, "png", optimize=True)
    return stream.getvalue()
