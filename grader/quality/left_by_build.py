"""The Python that a build has left and that is no text handed in: what runs is what is read, wherever it came from."""

from __future__ import annotations

import ast
import re
from collections.abc import Collection, Container, Sequence
from dataclasses import replace
from pathlib import Path, PurePosixPath

from grader.building import installed_code
from grader.evidence import reading_limits
from grader.host import ros_env
from grader.python_ast import parse
from grader.quality.source_files import PythonFile, within_limits
from grader.sandbox import untrusted

_LONGEST_START = 2000  # bytes; more could be code in a string
_DEFINES = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef, ast.Lambda, ast.For, ast.While, ast.comprehension)
_RUNS = (*_DEFINES, ast.Call, ast.Import, ast.ImportFrom)
# In CMake and in setup.py: what writes, configures, renames, compiles or runs something.
_MAKES_CODE = re.compile(
    r"\bRENAME\b|\b(CODE|SCRIPT)\b|\b(configure_file|execute_process|add_\w+|cmake_language|try_run)\s*\(|\bext_modules\b"
    r"|\bfile\s*\(\s*(?!GLOB|RELATIVE_PATH|READ|STRINGS)|\bcmdclass\b|\bopen\(|\bwrite|\bexec\(|\bsubprocess\b|\bshutil\b"
)


def with_installed(handed_in: Sequence[PythonFile], install: Path, nodes: Collection[str]) -> list[PythonFile]:
    """Return the files of a package with those that the build has left, each under the path that it has there.

    One takes the place of a file that was handed in under its path, or with its text.
    """
    left = left_by_build(handed_in, install, nodes)
    paths = {source.path for source in left}
    texts = {_text(source.data) for source in left if not source.starts}
    others = [source for source in handed_in if source.path not in paths and _text(source.data) not in texts]
    return sorted([*left, *others], key=lambda source: source.path)


def left_by_build(handed_in: Sequence[PythonFile], install: Path, nodes: Collection[str]) -> list[PythonFile]:
    """Return the Python in an install tree that is none of the texts handed in, or not where it was handed in.

    Names for constants, such as a module with the package's version, and empty files do not count. The program of a
    node that was handed in under another name does.
    """
    length = reading_limits.MAX_BYTES + 1
    found = installed_code.python_texts(install, nodes)
    installed = [(_path_in_package(path), data[:length]) for path, data in found]
    texts: dict[str, set[bytes]] = {}
    for path, data in installed:
        texts.setdefault(path, set()).add(data)
    replaced = {source.path for source in handed_in if source.data not in texts.get(source.path, {source.data})}
    stems = {_text(source.data): PurePosixPath(source.path).stem for source in handed_in if source.path not in replaced}
    left = {
        path: data
        for path, data in installed
        if path in replaced
        or (PurePosixPath(path).name in nodes and stems.get(_text(data)) not in nodes)
        or (_text(data) not in stems and _has(_RUNS, data))
    }
    return [
        replace(source, starts=source.path not in replaced and _only_starts(source.data, stems))
        for source in within_limits(sorted(left.items()))
    ]


def may_leave_code(packages: Sequence[Path], nodes: Collection[str]) -> bool:
    """Return whether a build may install other code than the text handed in: only then it has to be seen what it does.

    So it is where what decides the build mentions anything that makes code or gives it another name, or where there is
    something that cannot be read.
    """
    for package in packages:
        names = ("CMakeLists.txt",) if (package / "CMakeLists.txt").is_file() else ("setup.py",)
        texts = [untrusted.read_text(package / name, errors="replace") or "" for name in names]
        if any(map(_MAKES_CODE.search, texts)) or any(_is_other_code(path, nodes) for path in package.rglob("*")):
            return True
    return False


def _is_other_code(path: Path, nodes: Collection[str]) -> bool:
    """Return whether a file is a script of CMake, a link, nothing that can be read, or a node in another language."""
    if path.is_symlink() or path.suffix == ".cmake":
        return True
    if not path.is_file() or path.parent.name == "__pycache__":
        return False
    data = untrusted.read_bytes(path)
    return data is None or b"\0" in data or (path.name in nodes and not installed_code.PYTHON.match(data))


def _only_starts(data: bytes, handed_in: Container[bytes]) -> bool:
    """Return whether a text defines nothing of its own, so that there is nothing to measure in it."""
    return _text(data) in handed_in or not _has(_DEFINES, data)


def _path_in_package(path: str) -> str:
    """Return the path that an installed file would have in the package: below site-packages or share/<package>."""
    site, parts = ros_env.SITE_IN_PREFIX.parts, PurePosixPath(path).parts
    inside = parts[len(site) :] if parts[: len(site)] == site else parts[2:] if parts[0] == "share" else parts
    return "/".join(inside or parts)


def _text(data: bytes) -> bytes:
    return installed_code.without_first_line(data).strip()


def _has(kinds: tuple[type[ast.AST], ...], data: bytes) -> bool:
    """Return whether a text has code of one of these kinds; what is long or cannot be parsed may have any."""
    tree = parse(data) if len(data) <= _LONGEST_START else None
    return tree is None or any(isinstance(part, kinds) for part in ast.walk(tree))
