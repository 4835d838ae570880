"""The line that says what `check` and `run_node` are doing: shown below a running cell, gone at its end."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Any

import nbformat
from nbclient import NotebookClient

from grader.notebook.feedback import Progress

CELL = """
from grader.notebook.feedback import Progress

print("before")
with Progress() as progress:
    progress.say("building your package; the first time takes a minute")
    progress._began -= 12.4  # as if it had begun earlier
    progress._show()
    progress.more("compiling C++: 21 of 43")
    progress.say("starting robot_controller")
print("after")
"""


class Listener(NotebookClient):
    """A client that keeps what the kernel shows while the cell runs."""

    shown: list[str]

    def process_message(self, message: Any, cell: nbformat.NotebookNode, cell_index: int) -> Any:
        if message["msg_type"] == "update_display_data":
            self.shown.append(message["content"]["data"].get("text/plain", ""))
        return super().process_message(message, cell, cell_index)


def run(code: str, folder: Path) -> tuple[list[str], list[nbformat.NotebookNode]]:
    """Return what was shown meanwhile, and the cell's outputs at its end."""
    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(code)])
    client = Listener(notebook, kernel_name="python3", resources={"metadata": {"path": str(folder)}})
    client.shown = []
    asyncio.run(client.async_execute())
    return client.shown, notebook.cells[0].outputs


def test_each_step_is_shown_and_counted_and_nothing_is_left(tmp_path: Path):
    shown, outputs = run(CELL, tmp_path)
    first, counted, *_, further, second, last = shown
    assert first == "building your package; the first time takes a minute ..."
    assert counted == "building your package; the first time takes a minute ... (12 s)"
    assert further == "building your package (compiling C++: 21 of 43) ... (12 s)"
    assert second == "starting robot_controller ..."
    assert last == ""
    assert [output.get("text", output.get("data")) for output in outputs] == ["before\n", {}, "after\n"]


def test_outside_a_notebook_nothing_is_printed(capsys):
    with Progress() as progress:
        progress.say("building your package")
    assert capsys.readouterr() == ("", "")
