"""Recognise files and functions that the course laid out and that are unchanged. Trusts nothing in the marker.

`start_at` in a notebook writes it, and `begin` in a lane that gives some. A student can delete it, so its absence
proves nothing.
"""

from __future__ import annotations

import ast
import hashlib
import json
from collections.abc import Iterable, Mapping
from pathlib import Path, PurePosixPath
from typing import Any

from grader import python_ast
from grader.words import say_count, some

MARKER = ".course.json"
MAX_BYTES = 64 * 1024
MAX_FILES = 500
_MAX_SHOWN = 12


def note(package: Path) -> str:
    """Return sentences that name the files and functions laid out by the course; "" if there are none, or no marker."""
    files, given, said = unchanged(package), unchanged_functions(package), []
    if files:
        one = say_count(
            "{n} file was laid out by the course (start_at, or a lane) and not changed since, so not the student's own "
            "work: {names}.",
            "{n} files were laid out by the course (start_at, or a lane) and not changed since, so not the student's "
            "own work: {names}.",
            len(files),
            names=some(files, _MAX_SHOWN),
        )
        said.append(one)
    if given:
        one = say_count(
            "{n} function was given by the course (a lane) and not changed since: {names}.",
            "{n} functions were given by the course (a lane) and not changed since: {names}.",
            len(given),
            names=some(given, _MAX_SHOWN),
        )
        said.append(one)
    return " ".join(said)


def unchanged(package: Path) -> list[str]:
    """Return the paths of the files whose content still matches the marker's checksum."""
    return [
        name
        for name, digest in _read(package, "sha256").items()
        if (content := _content(package, name)) is not None and hashlib.sha256(content).hexdigest() == digest
    ]


def unchanged_functions(package: Path) -> list[str]:
    """Return the functions ("driver.py Driver.stop") whose code still matches the marker's checksum."""
    return [
        f"{PurePosixPath(path).name} {name}"
        for path, sums in _read(package, "functions").items()
        if isinstance(sums, dict) and (now := functions(_content(package, path) or b""))
        for name, digest in sums.items()
        if now.get(name) == digest
    ]


def add(
    package: Path,
    files: Mapping[str, str] | None = None,
    named: Mapping[str, tuple[str, Iterable[str]]] | None = None,
) -> None:
    """Note what the course has written into a package: texts of files, and functions `named` of a module's text."""
    marker = {kind: found for kind in ("sha256", "functions") if (found := _read(package, kind))}
    for path, text in (files or {}).items():
        marker.setdefault("sha256", {})[path] = hashlib.sha256(text.encode()).hexdigest()
    for path, (text, names) in (named or {}).items():
        sums = functions(text)
        marker.setdefault("functions", {}).setdefault(path, {}).update({name: sums[name] for name in sorted(names)})
    (package / MARKER).write_text(json.dumps(marker, indent=1) + "\n")


def functions(text: str | bytes) -> dict[str, str]:
    """Return the checksum of each function and method of a module by its name, whatever its comments."""
    found: dict[str, str] = {}
    try:
        for owner in (tree := python_ast.tree_of(text), *tree.body):
            if isinstance(owner, ast.Module | ast.ClassDef):
                prefix = f"{owner.name}." if isinstance(owner, ast.ClassDef) else ""
                inside = [node for node in owner.body if isinstance(node, python_ast.Function)]
                found |= {prefix + n.name: hashlib.sha256(ast.unparse(n).encode()).hexdigest() for n in inside}
    except python_ast.UNPARSABLE:
        return {}
    return found


def _read(package: Path, kind: str) -> dict[str, Any]:
    """Return what the marker says of files or functions, nothing if it is not as `add` writes it."""
    marker = package / MARKER
    try:
        if marker.is_symlink() or marker.stat().st_size > MAX_BYTES:
            return {}
        found = json.loads(marker.read_text(encoding="utf-8"))[kind]
    except (OSError, ValueError, RecursionError, TypeError, KeyError):
        return {}
    return found if isinstance(found, dict) and len(found) <= MAX_FILES else {}


def _content(package: Path, name: str) -> bytes | None:
    path = PurePosixPath(name)
    if path.is_absolute() or ".." in path.parts:
        return None
    try:
        # A submission that was taken in has only regular files.
        return (package / path).read_bytes()
    except (OSError, ValueError):
        return None
