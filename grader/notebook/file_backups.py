"""Keep the text that was changed outside of its cell, and tell which notebook wrote a file last.

Jupyter's `%%writefile` overwrites without asking. Before such a cell runs, a file that no cell has left as it is gets
copied into `kept/` in the workspace. A file that a later notebook has written, or that `%%into` has put functions
into, is not replaced unless the cell says `-f`. `%%into` waits for the cell that begins its notebook's version of the
file.
"""

from __future__ import annotations

import hashlib
import json
import re
import shlex
from collections.abc import Container, Mapping
from pathlib import Path
from typing import Any

from grader.notebook.workspace import Workspace, ignored_by_colcon
from grader.words import say

_WRITES = re.compile(r"(?:\s*#[^\n]*\n)*\s*%%(writefile|file|into) +([^\n]+)")
_INTO = "into"
FORCE = "-f"
"""Lets a cell replace the file of a later notebook, or one that holds pieces."""
APPENDS = {"-a", "--append"}
_FLAGS = {*APPENDS, FORCE}
# path -> checksum of the text that a cell last wrote there, that cell's notebook and magic
_WRITTEN = "written.json"


def target(cell: str) -> Path | None:
    """Return the file that a cell's `%%writefile` or `%%into` writes, None for another cell."""
    match = _WRITES.match(cell)
    try:
        words = [word for word in shlex.split(match[2]) if word not in _FLAGS] if match else []
    except ValueError:  # an unclosed quotation mark; %%writefile will report it
        return None
    return Path(words[0]).expanduser().resolve() if len(words) == 1 else None


class FileBackups:
    """The backups of a workspace, one of each file, made before and noted after each `%%writefile` cell."""

    def __init__(self, workspace: Workspace) -> None:
        self._workspace = workspace
        self._folder = workspace.root / "kept"

    def before(self, cell: str) -> str:
        """Keep the text that the cell is about to overwrite if no cell has written it, and return a line about it."""
        path = target(cell)
        content = _content(path) if path is not None else None
        if path is None or not content or content == cell.partition("\n")[2].encode():
            return ""
        if _sum(content) == self._written(path)[0]:
            return ""
        name = self._name(path)
        copy = self._folder / (f"elsewhere/{path.name}" if Path(name).is_absolute() else name)
        ignored_by_colcon(self._folder)
        copy.parent.mkdir(parents=True, exist_ok=True)
        copy.write_bytes(content)
        return say(
            "{path.name} was changed outside this notebook. That version is kept: {shown}",
            path=path,
            shown=self._workspace.shown(copy),
        )

    def refusal(self, cell: str, notebook: str, begun_here: Container[str] = ()) -> str:
        """Return why a cell of this notebook ("05") must not write its file, "" if it may.

        `begun_here` are the files of which the notebook has a version of its own, begun by a `%%writefile` cell.
        """
        path = target(cell)
        content = _content(path) if path is not None else None
        if path is None or not content or FORCE in cell.partition("\n")[0].split():
            return ""
        _, later, last = self._written(path)
        magic = _magic(cell)
        if content == cell.partition("\n")[2].encode():
            return ""
        if magic == _INTO and "" < later < notebook and self._name(path) in begun_here:
            return say(
                "Nothing was written: {path.name} is still that of notebook {later}. First run the cell above that "
                "begins with %%writefile {name}.",
                path=path,
                later=later,
                name=self._name(path),
            )
        if later > notebook:
            why = say(
                "notebook {later} has written it since, and this cell has the version of notebook {notebook}",
                later=later,
                notebook=notebook,
            )
        elif later == notebook and last == _INTO != magic and not APPENDS & {*cell.partition("\n")[0].split()}:
            why = say("it holds functions that you have put in since, and this cell would empty them")
        else:
            return ""
        return say(
            "{path.name} was not replaced: {why}. To replace it all the same, begin the cell with %%{magic} {force}.",
            path=path,
            why=why,
            magic=magic,
            force=FORCE,
        )

    def after(self, cell: str, notebook: str = "") -> None:
        """Note what the cell has written, and in which notebook."""
        path = target(cell)
        content = _content(path) if path is not None else None
        if path is not None and content is not None:
            self._note({self._name(path): [_sum(content), notebook, _magic(cell)]})

    def note_laid_out(self, notebooks: Mapping[str, str]) -> None:
        """Note the package's files that the course has laid out, with the notebook that each is from, and no others."""
        files = {name: _content(self._workspace.package / name) or b"" for name in notebooks}
        self._note({name: [_sum(content), notebooks[name], ""] for name, content in files.items()}, alone=True)

    def _note(self, written: dict[str, list[Any]], *, alone: bool = False) -> None:
        before = self._all_written()
        now = written if alone else before | written
        if now != before:
            ignored_by_colcon(self._folder)
            (self._folder / _WRITTEN).write_text(json.dumps(now, indent=1), encoding="utf-8")

    def _written(self, path: Path) -> tuple[str, str, str]:
        """Return the checksum of the text that a cell last wrote to a file, its notebook and magic; "" if unknown."""
        match self._all_written().get(self._name(path)):
            case [checksum, notebook, *magic]:
                return str(checksum), str(notebook), str(magic[0]) if magic else ""
        return "", "", ""

    def _name(self, path: Path) -> str:
        """Return the file's path in the package, or its absolute path if it is elsewhere."""
        package = self._workspace.package
        return str(path.relative_to(package) if path.is_relative_to(package) else path)

    def _all_written(self) -> dict[str, list[Any]]:
        try:
            found = json.loads((self._folder / _WRITTEN).read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return {}
        return found if isinstance(found, dict) else {}


def _magic(cell: str) -> str:
    match = _WRITES.match(cell)
    return match[1] if match else ""


def _content(path: Path) -> bytes | None:
    try:
        return path.read_bytes()
    except OSError:
        return None


def _sum(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()
