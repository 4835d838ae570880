"""Keep the text that was changed outside of its cell, and tell which notebook wrote a file last.

Jupyter's `%%writefile` overwrites without asking. `kept/` in the workspace has plain copies: of each file the last text
that no cell wrote, and below `.written`, by notebook and magic, what a cell left in it. A file that a later notebook
has written, or that `%%into` has put functions into, is not replaced unless the cell says `-f`.
"""

from __future__ import annotations

import shlex
import shutil
from collections.abc import Mapping
from pathlib import Path

from grader.notebook.workspace import Workspace, ignored_by_colcon
from grader.words import mark, say

_INTO = "into"
FORCE = "-f"
"""Lets a cell replace the file of a later notebook, or one that holds pieces."""
APPENDS = {"-a", "--append"}


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
        self._kept = workspace.root / "kept"
        self._written = self._kept / ".written"

    def keep(self, path: Path, text: str) -> str:
        """Keep what is in a file, which `text` is about to replace, if no cell wrote it; return a line about it."""
        content = _content(path)
        if not content or content == text.encode() or self._writers(path):
            return ""
        words = mark("{path.name} was changed outside this notebook. That version is kept: {shown}")
        return say(words, path=path, shown=self._workspace.shown(self._copy(path, self._kept)))

    def refusal(self, magic: str, line: str, text: str, notebook: str) -> str:
        """Return why a cell of this notebook ("05") must not write its file, "" if it may."""
        path, options = target(line), {*line.split()}
        content = _content(path) if path is not None else None
        if path is None or not content or content == text.encode() or FORCE in options:
            return ""
        writers = self._writers(path)
        later = max((writer for writer, _ in writers), default="")
        if later > notebook:
            words = mark("notebook {later} has written it since, and this cell has the version of notebook {notebook}")
            why = say(words, later=later, notebook=notebook)
        elif (notebook, _INTO) in writers and magic != _INTO and not APPENDS & options:
            why = say("it holds functions that you have put in since, and this cell would empty them")
        else:
            return ""
        words = mark(
            "{path.name} was not replaced: {why}. To replace it all the same, begin the cell with %%{magic} {force}."
        )
        return say(words, path=path, why=why, magic=magic, force=FORCE)

    def note(self, path: Path, notebook: str, magic: str = "") -> None:
        """Note what a cell has written to a file, and in which notebook."""
        if path.is_file():
            self._copy(path, self._written / f"{notebook}-{magic}")

    def note_laid_out(self, notebooks: Mapping[str, str]) -> None:
        """Note the package's files that the course has laid out, with the notebook that each is from, and no others."""
        shutil.rmtree(self._written, ignore_errors=True)
        for name, notebook in notebooks.items():
            self.note(self._workspace.package / name, notebook)

    def left(self, path: Path, notebook: str, magic: str) -> str:
        """Return what cells of a notebook with this magic have left in a file, "" if there are none."""
        text = _content(self._written / f"{notebook}-{magic}" / self.name(path)) or b""
        return text.decode(errors="replace")

    def writers(self, path: Path) -> set[str]:
        """Return the notebooks whose cells have left a file as it is."""
        return {notebook for notebook, _ in self._writers(path)}

    def _writers(self, path: Path) -> set[tuple[str, str]]:
        """Return the notebooks and magics whose cells have left a file as it is."""
        content, name = _content(path), self.name(path)
        writers = (folder.name for folder in self._written.glob("*-*") if _content(folder / name) == content)
        return {(notebook, magic) for notebook, _, magic in (writer.partition("-") for writer in writers)}

    def _copy(self, path: Path, folder: Path) -> Path:
        ignored_by_colcon(self._kept)
        copy = folder / self.name(path)
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(path, copy)
        return copy

    def name(self, path: Path) -> str:
        """Return the file's path in the package, or a name for a file elsewhere."""
        package = self._workspace.package
        return path.relative_to(package).as_posix() if path.is_relative_to(package) else f"elsewhere/{path.name}"


def _content(path: Path) -> bytes | None:
    try:
        return path.read_bytes()
    except OSError:
        return None
