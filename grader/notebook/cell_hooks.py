"""Run around each cell: pick up a new build, re-import changed modules; back up files before magics overwrite them."""

from __future__ import annotations

import os
import re
import sys
import time
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

from grader import KIT
from grader.notebook import before_begin, interface_types, lanes, last_hint, pieces, standing
from grader.notebook.file_backups import FORCE, FileBackups, target
from grader.notebook.workspace import NOTEBOOK, Workspace, course, prepare
from grader.words import say


class CellHooks:
    """The functions that the notebook's kernel calls around each cell."""

    def __init__(self, workspace: Workspace) -> None:
        self._workspace = workspace
        self._backups = FileBackups(workspace)
        self._last = time.monotonic()  # when a cell began or ended

    def draw(self) -> None:
        """Frame the figures that are about to be shown, and give them an alternative text for who does not see them."""
        if "matplotlib.figure" in sys.modules:
            from matplotlib.figure import Figure

            formatter = sys.modules["IPython"].get_ipython().display_formatter.formatters["image/png"]
            drawn = formatter.type_printers.get(Figure)
            if drawn is not None and getattr(drawn, "__name__", "") != "described":
                formatter.for_type(Figure, _described(drawn))

    def before(self, info: Any) -> None:
        """Update the environment and the imported modules, and count the time since the cell before."""
        self._count()
        last_hint.began(info.raw_cell, os.environ.get(NOTEBOOK, ""))
        prepare(self._workspace, os.environ)
        forget_changed_modules(self._workspace.package)

    def after(self, result: Any) -> None:
        """Count the time since the cell's begin, and show the last hint where the cell has tried something in vain."""
        self._count()
        if not result.success:
            last_hint.tried(right=False)
        elif last_hint.PYTEST.search(result.info.raw_cell):
            last_hint.tried_by_pytest(self._workspace.package)
        if hint := last_hint.due():
            from IPython.display import display

            display({"text/markdown": hint, "text/plain": hint}, raw=True)  # type: ignore[no-untyped-call]

    def _count(self) -> None:
        before, self._last = self._last, time.monotonic()
        standing.add_seconds(self._workspace, os.environ.get(NOTEBOOK, ""), self._last - before)

    def unless_later(self, magic: Callable[[str, str], None], name: str) -> Callable[[str, str], None]:
        """Return the cell magic `name`: it makes the file's folder, and leaves the files of later notebooks alone."""

        def write(line: str, cell: str) -> None:
            path, notebook = target(line), os.environ.get(NOTEBOOK, "")
            refusal = self._backups.refusal(name, line, cell, notebook)
            if refusal := refusal or lanes.refusal(self._workspace, notebook, name, path, line, cell):
                print(refusal)
                return
            if path:
                if kept := self._backups.keep(path, cell):
                    print(kept)
                path.parent.mkdir(parents=True, exist_ok=True)
            magic(" ".join(word for word in line.split(" ") if word != FORCE), cell)
            if path:
                self._backups.note(path, notebook, name)
                if name != pieces.MAGIC:
                    lanes.fill(self._workspace, notebook, path)

        return write


def install(workspace: Workspace) -> None:
    """Call the hooks around each cell from now on, in place of older ones, and make `%%into` known.

    Outside a notebook, do nothing.
    """
    # Python's bytecode cache would take two versions of a file written within one second for the same.
    sys.dont_write_bytecode = True
    module = sys.modules.get("IPython")
    shell = module.get_ipython() if module is not None else None
    if shell is None:
        return
    interface_types.check_fields()
    hooks = CellHooks(workspace)
    for event, callback in (
        ("pre_run_cell", hooks.before),
        ("post_execute", hooks.draw),
        ("post_run_cell", hooks.after),
    ):
        for older in list(shell.events.callbacks[event]):
            if isinstance(getattr(older, "__self__", None), CellHooks):
                shell.events.unregister(event, older)
        shell.events.register(event, callback)
    transforms = shell.input_transformers_cleanup
    if without_comments_above_a_magic not in transforms:
        transforms.insert(0, without_comments_above_a_magic)
    if names_of_the_file not in shell.Completer.custom_matchers:
        shell.Completer.custom_matchers.append(names_of_the_file)
    before_begin.install()
    warnings.formatwarning = format_warning
    shell.register_magic_function(hooks.unless_later(pieces.into, pieces.MAGIC), "cell", pieces.MAGIC)
    jupyters = shell.magics_manager.registry["OSMagics"].writefile  # whatever has taken its name
    for name in before_begin.WRITES:
        shell.register_magic_function(hooks.unless_later(jupyters, name), "cell", name)


def names_of_the_file(asked: Any) -> dict[str, Any]:
    """Return the completions in a cell that writes a file: what its file, and the package around it, define.

    The kernel knows only what was run in it. A class in the cell has what the file's class of that name has, too.
    """
    magic, _, body = asked.full_text.partition("\n")
    name, _, line = magic.partition(" ")
    path = target(line) if name.removeprefix("%%") in (pieces.MAGIC, *before_begin.WRITES) else None
    if path is None or asked.cursor_line == 0 or path.suffix not in (".py", ""):
        return {"completions": []}
    import jedi
    from IPython.core.completer import SimpleCompletion

    until = body.split("\n")[: asked.cursor_line]
    until[-1] = until[-1][: asked.cursor_position]
    text = path.read_text(encoding="utf-8", errors="replace") if path.is_file() else ""
    for known in re.findall(r"^class (\w+)", text, re.MULTILINE):
        until = [re.sub(rf"^class {known}\b.*:", f"class {known}({known}):", row) for row in until]
    project = jedi.Project(Path.cwd(), added_sys_path=[str(Path.cwd())])
    script = jedi.Script(
        "\n".join([text, *until]), path=path, project=project, environment=jedi.InterpreterEnvironment()
    )
    found = [each for each in script.complete() if each.complete is not None]
    # What rclpy and Python keep for themselves would come first, and is rarely meant.
    meant = [each for each in found if not each.name.startswith("_") or each.module_path == path] or found
    given = [SimpleCompletion(asked.token + (each.complete or ""), type=each.type) for each in meant]
    return {"completions": given, "suppress": bool(given)}


names_of_the_file.matcher_api_version = 2  # type: ignore[attr-defined]  # as IPython's decorator says it


def _described(draw: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """Return a function from a figure to its picture with a frame, and the picture's metadata."""
    from sim.views import framed

    def described(figure: Any) -> Any:
        drawn = draw(framed(figure))
        return drawn if isinstance(drawn, tuple) else (drawn, {"alt": words_of(figure)})

    return described


def words_of(figure: Any) -> str:
    """Return what a figure says of itself: titles, what is drawn over what, names in legends, the note below."""
    parts = [figure.get_suptitle()]
    for axes in figure.axes:
        over = say(" over ").join(filter(None, (axes.get_ylabel(), axes.get_xlabel())))
        names = ", ".join(axes.get_legend_handles_labels()[1])
        parts.append(": ".join(filter(None, (axes.get_title(), over, names))))
    parts.append(figure.get_supxlabel().replace("\n", " "))
    return f"Plot. {'; '.join(filter(None, parts))}".removesuffix(". ")


def without_comments_above_a_magic(lines: list[str]) -> list[str]:
    """Return a cell's lines without comments above its `%%` line: below them IPython looks for a line magic."""
    first = next((n for n, line in enumerate(lines) if line.strip() and not line.lstrip().startswith("#")), 0)
    return lines[first:] if lines and lines[first].startswith("%%") else lines


_USUAL_FORMAT = warnings.formatwarning


def format_warning(message: Warning | str, category: type[Warning], filename: str, *more: Any, **named: Any) -> str:
    """Return a warning as Python shows it, but without a place in the simulator, where there is nothing to fix."""
    if Path(filename).is_relative_to(KIT / "sim"):
        return f"{category.__name__}: {message}\n"
    return _USUAL_FORMAT(message, category, filename, *more, **named)


def forget_changed_modules(package: Path) -> None:
    """Forget the student's imported modules if one of their files has changed since.

    Python reads a module once, so a cell that imports it again would get the old one. A folder without `__init__.py`
    is forgotten, too: it would go on handing out the old modules in it.
    """
    files = {
        name: Path(getattr(module, "__file__", None) or package)
        for name, module in list(sys.modules.items())
        if name.partition(".")[0] == course().package
    }
    changed = {name: path.stat().st_mtime_ns if path.is_file() else 0 for name, path in files.items()}
    stamps = {name: stamp for name, stamp in changed.items() if files[name].is_relative_to(package)}
    if any(_STAMPS.get(name, stamp) != stamp for name, stamp in stamps.items()):
        for name in stamps:
            sys.modules.pop(name, None)
            _STAMPS.pop(name, None)
    else:
        _STAMPS.update(stamps)


_STAMPS: dict[str, int] = {}
