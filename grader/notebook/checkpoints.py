"""Which file each notebook adds to the package, and `start_at`, which lays out the work of the earlier notebooks.

The students' kit has the texts of the files packed in checkpoints.bin, unless the instructor has left them out. In a
checkout, an entry point names the function that makes them out of the solutions.
"""

from __future__ import annotations

import json
import shutil
import zlib
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from importlib.metadata import entry_points
from itertools import count
from pathlib import Path
from typing import Any

from grader.errors import GraderError
from grader.intake import course_marker
from grader.notebook.file_backups import FileBackups
from grader.notebook.workspace import Workspace, course, ignored_by_colcon
from grader.words import mark, say

PACKED = Path(__file__).parent / "checkpoints.bin"
"""The texts as compressed JSON: for each notebook ("05") its files by path."""

TEXTS = "ros2_course_kit.checkpoints"
"""The group of the entry point: a function from a notebook ("05") to its files by path."""


@dataclass(frozen=True)
class Checkpoint:
    """The files that one notebook adds or replaces, by their paths in the package.

    Students write the `exercises`, the course writes the `given` files, a command in the notebook writes those `made`.
    The `optional` files are the solution's; the notebook suggests them, and no cell writes them.
    """

    exercises: tuple[str, ...] = ()
    given: tuple[str, ...] = ()
    made: tuple[str, ...] = ()
    optional: tuple[str, ...] = ()

    @property
    def written(self) -> tuple[str, ...]:
        """Return the files that the notebook writes, by cells and by commands."""
        return (*self.given, *self.exercises, *self.made)


def table() -> Mapping[str, Checkpoint]:
    """Return the course's notebooks, each with its files."""
    rows = course().notebook_table["notebooks"]
    return {name: Checkpoint(**{kind: tuple(paths) for kind, paths in row.items()}) for name, row in rows.items()}


def _by_number() -> Mapping[str, Checkpoint]:
    return {name[:2]: checkpoint for name, checkpoint in table().items()}


def number(notebook: str) -> str:
    """Return "05" for "05" or "05_moving_safely".

    Raises:
        ValueError: the course has no such notebook.
    """
    found = notebook[:2]
    if found not in _by_number():
        words = mark("There is no notebook {notebook!r}; there are {known}.")
        raise ValueError(say(words, notebook=notebook, known=", ".join(table())))
    return found


def checkpoint(notebook: str) -> Checkpoint:
    """Return the files that a notebook ("05") adds or replaces."""
    return _by_number()[number(notebook)]


def written_in(path: str) -> str:
    """Return the first notebook ("05") that writes a file of the package, "" if none does."""
    return next((key for key, files in _by_number().items() if path in files.written), "")


def writers_before(key: str) -> dict[str, str]:
    """Return for each file that the notebooks before this one ("05") write the last of them, in the course's order."""
    return {path: earlier for earlier, files in _by_number().items() if earlier < key for path in files.written}


def files_after(notebook: str) -> dict[str, str]:
    """Return the text of every file of the package at the end of a notebook ("05"), solved.

    Raises:
        GraderError: this kit holds no solutions.
    """
    last = number(notebook)
    return {path: text for key in _by_number() if key <= last for path, text in texts(key).items()}


def start_at(workspace: Workspace, notebook: str) -> str:
    """Lay out the package as the notebooks before `notebook` leave it, and return a report in words.

    The package's present content is moved to a backup in the workspace.
    """
    key = number(notebook)
    earlier = [each for each in _by_number() if each < key]
    try:
        files = files_after(earlier[-1]) if earlier else {}
    except GraderError as error:
        return say("start_at({key!r}): {error}", key=key, error=error)
    package = workspace.package
    package.mkdir(parents=True, exist_ok=True)
    backup = _back_up(workspace)
    write_files(package, files)
    writers = writers_before(key)
    FileBackups(workspace).note_laid_out({path: writers.get(path, "") for path in files})
    if own := _student_work_before(key):
        course_marker.add(package, files={path: files[path] for path in sorted(own)})
    text = mark("Your package now holds what the notebooks before {key} leave: {n} files, laid out by the course.")
    words = say(text, key=key, n=len(files))
    moved = mark("{words} Its earlier content is in {shown}.")
    return say(moved, words=words, shown=workspace.shown(backup)) if backup else words


def write_files(package: Path, files: Mapping[str, str]) -> None:
    """Write the files of a package; scripts can be run."""
    for path, text in files.items():
        target = package / path
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_text(text, encoding="utf-8")
        if text.startswith("#!"):
            target.chmod(0o755)


def patient(case: str) -> dict[str, Any]:
    """Return a case of the clinic: `files` of the ill package, texts `installed` in their place, `where` the fault is.

    Raises:
        GraderError: this kit holds no solutions, and so no patients.
    """
    ill = texts(case)
    return ill | {"files": files_after(max(_by_number())) | ill["files"]}


def _student_work_before(key: str) -> set[str]:
    """Return the files that students write in the notebooks before this one and that the course does not replace."""
    own: set[str] = set()
    for files in (files for earlier, files in _by_number().items() if earlier < key):
        own = (own | {*files.exercises, *files.made, *files.optional}) - {*files.given}
    return own


def texts(name: str) -> dict[str, Any]:
    """Return the texts of a notebook's ("05") files, or the patient of a case ("C3")."""
    if PACKED.is_file():
        packed: dict[str, dict[str, Any]] = json.loads(zlib.decompress(PACKED.read_bytes()))
        if name in packed or name in _by_number():
            return packed.get(name, {})  # the last notebook's are never there: `start_at` needs those before it
    else:
        for entry in entry_points(group=TEXTS):
            with suppress(ModuleNotFoundError):  # a students' kit in the environment of a checkout
                return dict(entry.load()(name))
    raise GraderError(say("this kit holds no solutions to lay out; your instructor has left them out."))


def _back_up(workspace: Workspace) -> Path | None:
    """Move the package's content to a new folder beside src and return that folder; None if the package is empty."""
    content = [path for path in workspace.package.iterdir() if path.name != "__pycache__"]
    if not content:
        return None
    backup = next(path for n in count(1) if not (path := workspace.root / f"backup-{n}").exists())
    ignored_by_colcon(backup)  # it holds a package.xml, and colcon refuses two packages of one name
    for path in content:
        shutil.move(path, backup / path.name)
    return backup
