"""Keep `%%writefile` from writing beside the notebooks in a kernel that has not run `begin` yet.

After a kernel's restart, a cell would put its file into notebooks/, and the checks would go on with the old one.
IPython loads this module as an extension, by a setting that `begin` leaves in the virtual environment.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

from grader.words import say

WRITES = ("writefile", "file")
"""The names of the cell magic that writes a file."""
_SETTING = "c.InteractiveShellApp.extensions.append('grader.notebook.before_begin')\n"


def install(prefix: Path | None = None) -> None:
    """Let every later kernel of this virtual environment load the extension."""
    prefix = prefix or Path(sys.prefix)
    path = prefix / "etc" / "ipython" / "ipython_config.py"
    if not (prefix / "pyvenv.cfg").is_file() or (path.is_file() and _SETTING in path.read_text()):
        return
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("a") as file:
            file.write(_SETTING)
    except OSError:  # an environment that others own; the kernel works without
        return


def load_ipython_extension(shell: Any) -> None:
    """Refuse to write into a folder notebooks/ of this course, until `begin` has opened the package."""
    folder = Path.cwd()
    if folder.name != "notebooks" or not (folder.parent / "grader").is_dir():
        return
    for name in WRITES:
        shell.register_magic_function(_refuse, "cell", name)


def _refuse(line: str, _cell: str) -> None:
    from IPython.core.error import UsageError

    raise UsageError(
        say(
            "Nothing was written: {line} would land beside the notebooks. Run the first cell of this "
            "notebook, which opens your package, then this one again.",
            line=line.strip(),
        )
    )
