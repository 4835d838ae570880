"""What happens around each cell: a new build is seen, changed modules are read again, overwritten files are kept."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Any

from grader.notebook.file_backups import Keeper
from grader.notebook.workspace import PACKAGE, Workspace, prepare


class Watcher:
    """Called by the notebook's kernel before and after each cell."""

    def __init__(self, workspace: Workspace) -> None:
        self._workspace = workspace
        self._keeper = Keeper(workspace)

    def before(self, info: Any) -> None:
        """Make the cell find what is there now."""
        prepare(self._workspace, os.environ)
        forget_changed_modules(self._workspace.package)
        if said := self._keeper.before(info.raw_cell):
            print(said)

    def after(self, result: Any) -> None:
        """Remember what the cell has written."""
        self._keeper.after(result.info.raw_cell)


def watch(workspace: Workspace) -> None:
    """Call a watcher around each cell from now on, where this is a notebook; only the last one counts."""
    # Two versions of a file, written within one second, would pass for the same in Python's cache.
    sys.dont_write_bytecode = True
    module = sys.modules.get("IPython")
    shell = module.get_ipython() if module is not None else None
    if shell is None:
        return
    watcher = Watcher(workspace)
    for event, callback in (("pre_run_cell", watcher.before), ("post_run_cell", watcher.after)):
        for older in list(shell.events.callbacks[event]):
            if isinstance(getattr(older, "__self__", None), Watcher):
                shell.events.unregister(event, older)
        shell.events.register(event, callback)


def forget_changed_modules(package: Path) -> None:
    """Forget the student's modules that this process has imported if one of their files has changed since.

    Python reads a module once, so a cell that imports it again would go on with the old one.
    """
    loaded = {
        name: Path(file)
        for name, module in list(sys.modules.items())
        if name.partition(".")[0] == PACKAGE
        and (file := getattr(module, "__file__", None))
        and Path(file).is_relative_to(package)
    }
    stamps = {name: _stamp(path) for name, path in loaded.items()}
    if any(_STAMPS.get(name, stamp) != stamp for name, stamp in stamps.items()):
        for name in loaded:
            sys.modules.pop(name, None)
            _STAMPS.pop(name, None)
    else:
        _STAMPS.update(stamps)


_STAMPS: dict[str, tuple[int, int]] = {}


def _stamp(path: Path) -> tuple[int, int]:
    try:
        found = path.stat()
    except OSError:
        return (0, 0)
    return found.st_mtime_ns, found.st_size
