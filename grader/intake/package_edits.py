"""Edits of a copy of a package: attacks, known-bad edits, leagues and renamed courses are made with them."""

from __future__ import annotations

import difflib
import shutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import yaml

from grader.intake.names import build_tree
from grader.yaml_reader import YamlReader

Change = Callable[[Path], None]
"""An edit of a package's folder."""


def copy(package: Path, folder: Path) -> Path:
    """Copy a package's source below `folder` and return the copy, which has the same name."""

    def made(here: str, names: list[str]) -> list[str]:
        return [name for name in names if name in ("__pycache__", ".pytest_cache") or build_tree(Path(here, name))]

    target = folder / package.name
    shutil.copytree(package, target, ignore=made)
    return target


def put(path: str, text: str, *, executable: bool = False) -> Change:
    """Return a change that writes a file."""

    def change(package: Path) -> None:
        file = package / path
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="utf-8")
        if executable:
            file.chmod(0o755)

    return change


def append(path: str, text: str) -> Change:
    """Return a change that adds text to the end of a file."""

    def change(package: Path) -> None:
        file = package / path
        file.write_text((file.read_text(encoding="utf-8") if file.exists() else "") + text, encoding="utf-8")

    return change


def replace(path: str, old: str, new: str) -> Change:
    """Return a change that replaces a text that must occur in a file exactly once."""

    def change(package: Path) -> None:
        text = (package / path).read_text(encoding="utf-8")
        if text.count(old) != 1:
            raise ValueError(f"{old!r} occurs {text.count(old)} times in {path}, not once")
        (package / path).write_text(text.replace(old, new), encoding="utf-8")

    return change


def remove(path: str) -> Change:
    """Return a change that removes a file or a folder."""

    def change(package: Path) -> None:
        target = package / path
        if target.is_dir():
            shutil.rmtree(target)
        else:
            target.unlink()

    return change


def rename(old: str, new: str) -> Change:
    """Return a change that replaces a text in every file, and in the names of files and folders."""

    def change(package: Path) -> None:
        for path in sorted(package.rglob("*"), reverse=True):  # what is in a folder comes before it
            if path.is_file() and old in (text := path.read_text(encoding="utf-8")):
                path.write_text(text.replace(old, new), encoding="utf-8")
            if old in path.name:
                path.rename(path.with_name(path.name.replace(old, new)))

    return change


@dataclass(frozen=True)
class Edit:
    """An edit as a course writes it in YAML: `old`, which `file` has once, becomes `new`."""

    file: str
    old: str
    new: str

    def made(self, package: Path, folder: Path) -> Path:
        """Return a copy of a package below `folder` with this edit."""
        edited = copy(package, folder)
        replace(self.file, self.old, self.new)(edited)
        return edited


def read(reader: YamlReader, given: Mapping[str, yaml.Node], solution: Path) -> Edit:
    """Return the edit of the solution that the fields file, old and new are.

    Raises:
        GraderError: it does not fit; file and line are named.
    """
    files = [file.relative_to(solution).as_posix() for file in solution.rglob("*") if file.is_file()]
    edit = Edit(*(reader.text(given[name]) for name in ("file", "old", "new")))
    reader.require_known(edit.file, given["file"], files, "a file of the solution")
    text = (solution / edit.file).read_text(encoding="utf-8")
    if (count := text.count(edit.old)) != 1:
        said = f"`old` occurs {count} times in {edit.file} of the solution, not once"
        reader.fail(given["old"], said + ("" if count else _nearest_line(edit.old, text)))
    return edit


def _nearest_line(old: str, text: str) -> str:
    wanted = next((line.strip() for line in old.splitlines() if line.strip()), "")
    lines = [line.strip() for line in text.splitlines()]
    near = difflib.get_close_matches(wanted, lines, 1, 0.5)
    return f"; its nearest line, {lines.index(near[0]) + 1}, is: {near[0]}" if near else ""
