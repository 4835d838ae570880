"""Keep what `%%writefile` would overwrite: a file may have been edited elsewhere since a cell wrote it.

The cells use Jupyter's own `%%writefile`, which asks nothing. Before such a cell runs, the file's present content is
copied into `kept/` in the workspace, unless a cell wrote it: that text was in a notebook.
"""

from __future__ import annotations

import hashlib
import json
import re
import shlex
from datetime import datetime
from pathlib import Path

from grader.notebook.workspace import Workspace, ignored_by_colcon

_WRITES = re.compile(r"\s*%%(?:writefile|file) +([^\n]+)")
_NOTES = "written.json"  # path -> checksum of what a cell wrote there last


def target(cell: str) -> Path | None:
    """Return the file that a cell's `%%writefile` writes, None for another cell."""
    match = _WRITES.match(cell)
    try:
        words = [word for word in shlex.split(match[1]) if word not in ("-a", "--append")] if match else []
    except ValueError:  # a quotation mark without its partner; %%writefile will say so
        return None
    return Path(words[0]).expanduser().resolve() if len(words) == 1 else None


class Keeper:
    """Looks at each cell before and after it is run."""

    def __init__(self, workspace: Workspace) -> None:
        self._workspace = workspace
        self._folder = workspace.root / "kept"

    def before(self, cell: str, now: datetime | None = None) -> str:
        """Keep what the cell is about to overwrite; return a line that says so, "" if there was nothing to keep."""
        path = target(cell)
        content = _content(path) if path is not None else None
        if path is None or not content or _sum(content) == self._notes().get(self._name(path)):
            return ""
        if content == cell.partition("\n")[2].encode():
            return ""
        copy = self._copy_of(path, now or datetime.now())
        ignored_by_colcon(self._folder)
        copy.parent.mkdir(parents=True, exist_ok=True)
        copy.write_bytes(content)
        return f"{path.name} was changed outside this notebook. What it held is kept: {self._workspace.shown(copy)}"

    def after(self, cell: str) -> None:
        """Note what the cell has written."""
        path = target(cell)
        content = _content(path) if path is not None else None
        if path is None or content is None:
            return
        notes = self._notes()
        if notes.get(self._name(path)) != _sum(content):
            ignored_by_colcon(self._folder)
            text = json.dumps(notes | {self._name(path): _sum(content)}, indent=1)
            (self._folder / _NOTES).write_text(text, encoding="utf-8")

    def _name(self, path: Path) -> str:
        """Return the file's place below the package, or its whole path if it lies elsewhere."""
        package = self._workspace.package
        return str(path.relative_to(package) if path.is_relative_to(package) else path)

    def _copy_of(self, path: Path, now: datetime) -> Path:
        """Return where a copy goes that is not there yet: "driver 2026-05-01 14.03.59.py"."""
        name = Path(self._name(path))
        folder = self._folder / (name.parent if not name.is_absolute() else "elsewhere")
        stem = f"{name.stem} {now:%Y-%m-%d %H.%M.%S}"
        copy, number = folder / f"{stem}{name.suffix}", 1
        while copy.exists():
            number += 1
            copy = folder / f"{stem} ({number}){name.suffix}"
        return copy

    def _notes(self) -> dict[str, str]:
        try:
            found = json.loads((self._folder / _NOTES).read_text(encoding="utf-8"))
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
