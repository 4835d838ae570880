"""Functions that edit a copy of a package: attacks, known-bad edits and renamed courses are made with them."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

from grader.intake.names import build_tree

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
