"""Back up a file that `%%writefile` is about to overwrite, if it was edited elsewhere since a cell wrote it.

Jupyter's `%%writefile` overwrites without asking. Before such a cell runs, the file is copied into `kept/` in the
workspace, unless a cell wrote it: that text is in a notebook.
"""

from __future__ import annotations

import hashlib
import json
import re
import shlex
from datetime import datetime
from pathlib import Path

from grader.notebook.workspace import Workspace, ignored_by_colcon

_WRITES = re.compile(r"\s*%%(?:writefile|file|into) +([^\n]+)")
_CHECKSUMS = "written.json"  # path -> checksum of the text that a cell last wrote there


def target(cell: str) -> Path | None:
    """Return the file that a cell's `%%writefile` or `%%into` writes, None for another cell."""
    match = _WRITES.match(cell)
    try:
        words = [word for word in shlex.split(match[1]) if word not in ("-a", "--append")] if match else []
    except ValueError:  # an unclosed quotation mark; %%writefile will report it
        return None
    return Path(words[0]).expanduser().resolve() if len(words) == 1 else None


class FileBackups:
    """The backups of a workspace, made before and noted after each `%%writefile` cell."""

    def __init__(self, workspace: Workspace) -> None:
        self._workspace = workspace
        self._folder = workspace.root / "kept"

    def before(self, cell: str, now: datetime | None = None) -> str:
        """Back up the file that the cell is about to overwrite; return a line about it, "" if there is no need."""
        path = target(cell)
        content = _content(path) if path is not None else None
        if path is None or not content or _sum(content) == self._checksums().get(self._name(path)):
            return ""
        if content == cell.partition("\n")[2].encode():
            return ""
        copy = self._copy_of(path, now or datetime.now())
        ignored_by_colcon(self._folder)
        copy.parent.mkdir(parents=True, exist_ok=True)
        copy.write_bytes(content)
        return f"{path.name} was changed outside this notebook. That version is kept: {self._workspace.shown(copy)}"

    def after(self, cell: str) -> None:
        """Note the checksum of the file that the cell has written."""
        path = target(cell)
        content = _content(path) if path is not None else None
        if path is None or content is None:
            return
        checksums = self._checksums()
        if checksums.get(self._name(path)) != _sum(content):
            ignored_by_colcon(self._folder)
            text = json.dumps(checksums | {self._name(path): _sum(content)}, indent=1)
            (self._folder / _CHECKSUMS).write_text(text, encoding="utf-8")

    def _name(self, path: Path) -> str:
        """Return the file's path in the package, or its absolute path if it is elsewhere."""
        package = self._workspace.package
        return str(path.relative_to(package) if path.is_relative_to(package) else path)

    def _copy_of(self, path: Path, now: datetime) -> Path:
        """Return an unused path for a copy: "driver 2026-05-01 14.03.59.py"."""
        name = Path(self._name(path))
        folder = self._folder / (name.parent if not name.is_absolute() else "elsewhere")
        stem = f"{name.stem} {now:%Y-%m-%d %H.%M.%S}"
        copy, number = folder / f"{stem}{name.suffix}", 1
        while copy.exists():
            number += 1
            copy = folder / f"{stem} ({number}){name.suffix}"
        return copy

    def _checksums(self) -> dict[str, str]:
        try:
            found = json.loads((self._folder / _CHECKSUMS).read_text(encoding="utf-8"))
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
