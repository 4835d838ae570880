"""Keep the text that was changed outside of its cell, and tell which notebook wrote a file last.

Jupyter's `%%writefile` overwrites without asking. Before such a cell writes, a file that no cell has left as it is gets
copied into `kept/` in the workspace. A file that a later notebook has written, or that `%%into` has put functions
into, is not replaced unless the cell says `-f`. `%%into` waits for the cell that begins its notebook's version of the
file.
"""

from __future__ import annotations

import hashlib
import json
import shlex
from collections.abc import Container, Mapping
from pathlib import Path
from typing import Any

from grader.notebook.workspace import Workspace, ignored_by_colcon
from grader.words import say

_INTO = "into"
FORCE = "-f"
"""Lets a cell replace the file of a later notebook, or one that holds pieces."""
APPENDS = {"-a", "--append"}
# path -> checksum of the text that a cell last wrote there, that cell's notebook and magic
_WRITTEN = "written.json"


def target(line: str) -> Path | None:
    """Return the file that a cell writes, from the line of its magic; None if that names none."""
    try:
        words = [word for word in shlex.split(line) if word not in {*APPENDS, FORCE}]
    except ValueError:  # an unclosed quotation mark; %%writefile will report it
        return None
    return Path(words[0]).expanduser().resolve() if len(words) == 1 else None


class FileBackups:
    """The backups of a workspace, one of each file, and what cells have written to it."""

    def __init__(self, workspace: Workspace) -> None:
        self._workspace = workspace
        self._folder = workspace.root / "kept"

    def keep(self, path: Path, text: str) -> str:
        """Keep what is in a file, which `text` is about to replace, if no cell wrote it; return a line about it."""
        content = _content(path)
        if not content or content == text.encode() or _sum(content) == self._written(path)[0]:
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

    def refusal(self, magic: str, line: str, text: str, notebook: str, begun_here: Container[str] = ()) -> str:
        """Return why a cell of this notebook ("05") must not write its file, "" if it may.

        `begun_here` are the files of which the notebook has a version of its own, begun by a `%%writefile` cell.
        """
        path, options = target(line), {*line.split()}
        content = _content(path) if path is not None else None
        if path is None or not content or content == text.encode() or FORCE in options:
            return ""
        _, later, last = self._written(path)
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
        elif later == notebook and last == _INTO != magic and not APPENDS & options:
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

    def note(self, path: Path, notebook: str, magic: str = "") -> None:
        """Note what a cell has written to a file, and in which notebook."""
        if (content := _content(path)) is not None:
            self._note({self._name(path): [_sum(content), notebook, magic]})

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


def _content(path: Path) -> bytes | None:
    try:
        return path.read_bytes()
    except OSError:
        return None


def _sum(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()
