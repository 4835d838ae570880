"""Run a notebook from top to bottom in a workspace of its own, as shipped or solved; say what its checks answered."""

from __future__ import annotations

import asyncio
import os
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from nbformat import NotebookNode

from grader import KIT
from grader.authoring import checkpoint_texts, notebook_source
from grader.errors import GraderError

CELL_SECONDS = 600.0  # a cell that takes longer hangs; on a busy machine the tests of notebook 09 take minutes
WORKSPACE = "ROS2_COURSE_WS"

Solutions = Callable[[str, str], str]
"""Given a notebook and a path in the package, the text of that file as the reference has it after that notebook."""


@dataclass
class Performance:
    """A notebook that was run, with its outputs; `error` is the exception that ended it early, if one did."""

    notebook: NotebookNode
    seconds: float = 0.0
    error: str | None = None
    cell_seconds: dict[str, float] = field(default_factory=dict)

    @property
    def answers(self) -> list[str]:
        """Return the first line of each answer of the checks, such as "F4 not yet (0 of 5): ..."."""
        return [line for cell in self.notebook.cells for line in answers(cell)]


def answers(cell: NotebookNode) -> list[str]:
    """Return the lines "F4 passed ..." and "F4 not yet ..." in the stored outputs of a check cell."""
    wanted = notebook_source.checked(cell) if notebook_source.CHECK in notebook_source.tags(cell) else []
    if not wanted:
        return []
    text = "\n".join(said(output) for output in cell.get("outputs", []))
    known = "|".join(map(re.escape, wanted))
    return [match[0].strip() for match in re.finditer(rf"^ *(?:{known}) +(?:passed|not yet)\b.*$", text, re.MULTILINE)]


def said_by_checks(notebook: NotebookNode) -> list[str]:
    """Return all that the notebook's checks answered, what was seen and what is to be tried included."""
    cells = [cell for cell in notebook.cells if notebook_source.CHECK in notebook_source.tags(cell)]
    return [said(output) for cell in cells for output in cell.get("outputs", [])]


def said(output: NotebookNode) -> str:
    """Return an output's plain text."""
    return str(output.get("text") or output.get("data", {}).get("text/plain", ""))


def play(notebook: NotebookNode, workspace: Path, kit: Path = KIT) -> Performance:
    """Run the notebook in `workspace` (made if it is not there) and return it with its outputs.

    The kernel is this Python's; its current folder is an empty one, so that nothing is written into the kit.
    """
    from nbclient import NotebookClient
    from nbclient.exceptions import CellExecutionError

    played = Performance(notebook)
    began: dict[str, float] = {}
    with tempfile.TemporaryDirectory(prefix="notebook-") as folder:
        client = NotebookClient(
            notebook,
            timeout=CELL_SECONDS,
            kernel_name="python3",
            record_timing=False,
            store_widget_state=False,
            resources={"metadata": {"path": folder}},
            on_cell_start=lambda cell, **_: began.__setitem__(cell["id"], time.monotonic()),
            on_cell_executed=lambda cell, **_: played.cell_seconds.__setitem__(
                cell["id"], time.monotonic() - began[cell["id"]]
            ),
        )
        started = time.monotonic()
        try:
            # A loop of its own, closed in the end: the one that nbclient would make stays open for ever.
            asyncio.run(client.async_execute(env=environment(workspace, kit)))
        except CellExecutionError as error:
            played.error = _words(played, error)
        except (TimeoutError, RuntimeError) as error:  # a cell that hangs, a kernel that dies
            played.error = f"{type(error).__name__}: {error}"
        played.seconds = time.monotonic() - started
    return played


def _words(played: Performance, error: Exception) -> str:
    """Return which cell failed and how, without the colours that are meant for a notebook."""
    failed = next((cell["id"] for cell in played.notebook.cells if _raised(cell)), "?")
    return f"cell {failed}:\n" + re.sub(r"\x1b\[[0-9;]*m", "", str(error))


def _raised(cell: NotebookNode) -> bool:
    return any(output.output_type == "error" for output in cell.get("outputs", []))


def environment(workspace: Path, kit: Path = KIT) -> dict[str, str]:
    """Return the environment of a kernel whose package lies in `workspace`, with the `grader` and `sim` of `kit`."""
    workspace.mkdir(parents=True, exist_ok=True)
    path = os.environ.get("PYTHONPATH", "").split(os.pathsep)
    # Not `os.environ | ...`: another thread may take a name away meanwhile, as pytest does with that of the last test.
    outer = {name: value for name in list(os.environ) if (value := os.environ.get(name)) is not None}
    return outer | {
        WORKSPACE: str(workspace),
        "PYTHONPATH": os.pathsep.join([str(kit), *filter(None, path)]),
        "IPYTHONDIR": str(workspace.parent / "ipython"),
        "PYDEVD_DISABLE_FILE_VALIDATION": "1",  # else the debugger greets each kernel on a stream of its own
    }


def solved(name: str, notebook: NotebookNode, solutions: Solutions) -> NotebookNode:
    """Return the notebook with the reference's file in each exercise."""
    for cell in notebook.cells:
        if notebook_source.EXERCISE in notebook_source.tags(cell) and (path := notebook_source.written_file(cell)):
            cell.source = notebook_source.with_body(cell, solutions(name, path))
    return notebook


def solve(name: str, notebook: NotebookNode) -> Performance:
    """Run the notebook solved, in a workspace that holds what the notebooks before it leave."""
    with tempfile.TemporaryDirectory(prefix="book-") as scratch:
        workspace = Path(scratch) / "ws"
        ran = subprocess.run(
            [sys.executable, "-c", f"from grader.notebook import start_at; start_at({name[:2]!r})"],
            env=environment(workspace), capture_output=True, text=True, check=False, timeout=CELL_SECONDS,
        )  # fmt: skip
        if ran.returncode:
            raise GraderError(f"The course could not be laid out before {name}:\n{ran.stderr[-2000:]}")
        played = play(solved(name, notebook, checkpoint_texts.solution), workspace)
    if played.error is None and (missing := unpassed(played.notebook)):
        played.error = f"{name}: solved, but not passed: {', '.join(missing)}"
    return played


def unpassed(notebook: NotebookNode) -> list[str]:
    """Return the requirements which a check of the notebook did not answer with "passed"."""
    found = []
    for cell in notebook.cells:
        passed = {line.split()[0] for line in answers(cell) if re.match(r"\w+ +passed\b", line)}
        if notebook_source.CHECK in notebook_source.tags(cell):
            found += [name for name in notebook_source.checked(cell) if name not in passed]
    return found


def passed_too_early(notebook: NotebookNode) -> list[str]:
    """Return the requirements for which a check of an untouched notebook did not answer "not yet"."""
    found = []
    for cell in notebook.cells:
        open_ = {line.split()[0] for line in answers(cell) if re.match(r"\w+ +not yet\b", line)}
        if notebook_source.CHECK in notebook_source.tags(cell):
            found += [name for name in notebook_source.checked(cell) if name not in open_]
    return found


def path_patterns(workspace: Path) -> list[tuple[str, str]]:
    """Return (pattern, replacement) for what outputs may tell of a machine: first match first."""
    return [
        (re.escape(str(workspace.resolve())), "ws"),
        (re.escape(str(workspace)), "ws"),
        (re.escape(str(Path(sys.prefix))), ".venv"),
        (re.escape(str(KIT)), "kit"),
        (r"/tmp/ipykernel_\d+/\d+\.py", "<cell>"),
    ]


def without_paths(text: str, workspace: Path) -> str:
    """Return `text` with the places of this machine replaced by what they are."""
    for pattern, replacement in path_patterns(workspace):
        text = re.sub(pattern, replacement, text)
    return text
