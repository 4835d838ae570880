"""The Python files of a package as bytes: found, within limits, and copied for tools to read."""

from __future__ import annotations

import os
import re
import tokenize
from collections.abc import Iterable
from dataclasses import dataclass, replace
from io import BytesIO
from pathlib import Path, PurePosixPath

from grader.course import Course
from grader.evidence import reading_limits
from grader.intake.names import build_tree, tool_folder

# Made by tools, beside the student's own folders. What the build takes from them is read where it ran.
_OF_TOOLS = {".github", ".gitlab", ".circleci", ".history", ".devcontainer", ".direnv", ".cache", ".local"}
_FOLDERS = ("launch", "scripts", "test", "tests")
_SHEBANG = re.compile(rb"#!.*python")
_MAX_SHEBANG = 200
_BYTES_OF_A_LINE = 100  # a longer line counts as several
_BYTES_OF_A_SHORT_LINE = 40


@dataclass(frozen=True)
class PythonFile:
    """One Python file. `copy` is the path of the copy for the tools; `problem` says why there is none."""

    path: str
    data: bytes
    problem: str = ""
    copy: str = ""

    @property
    def rough_lines(self) -> int:
        """Return the number of lines that are neither blank nor comment, for a file that cannot be parsed.

        A long line counts as several: otherwise a file on one line would count for next to nothing.
        """
        if self.problem == reading_limits.TOO_LARGE:
            # What was read of it may be comments, and what comes after them anything.
            return len(self.data) // _BYTES_OF_A_SHORT_LINE
        lines = (line.strip() for line in self.data.splitlines())
        return sum(1 + len(line) // _BYTES_OF_A_LINE for line in lines if line and not line.startswith(b"#"))


def find(package: Path, course: Course) -> list[PythonFile]:
    """Return the package's Python files, ordered by path, up to the reading limits."""
    length = reading_limits.MAX_BYTES + 1
    paths = sorted(_python(package, course), key=lambda path: _rank(path, course))
    found = within_limits((path, _start(package / path, length)) for path in paths)
    return sorted(found, key=lambda source: source.path)


def within_limits(files: Iterable[tuple[str, bytes]]) -> list[PythonFile]:
    """Return these files, given by path and content, up to the reading limits of a package."""
    found: list[PythonFile] = []
    total = 0
    for path, data in files:
        if len(found) == reading_limits.MAX_FILES or total > reading_limits.MAX_TOTAL_BYTES:
            many = len(found) == reading_limits.MAX_FILES
            found.append(PythonFile(path, b"", problem=reading_limits.TOO_MANY if many else reading_limits.TOO_MUCH))
            break
        total += len(data)
        found.append(PythonFile(path, data, problem=_problem(data)))
    return found


def find_in_both(package: Path, interfaces: Path | None, course: Course) -> list[PythonFile]:
    """Return the Python files of a package and of its package of interfaces, which may have modules of its own."""
    found = {source.path: source for source in find(package, course)}
    if interfaces is not None:
        for source in find(interfaces, course):
            path = source.path if source.path not in found else f"{interfaces.name}/{source.path}"
            found[path] = replace(source, path=path)
    return [found[path] for path in sorted(found)]


def _python(package: Path, course: Course) -> list[str]:
    """Return the paths of the modules, and of the programs without `.py` whose first line asks for Python."""
    found = []
    for path in package_files(package, course):
        name = PurePosixPath(path).name
        # `node.bak` beside a program is an editor's copy of it.
        is_program = "." not in name[1:] and not name.endswith("~")
        if name.endswith(".py") or (is_program and _SHEBANG.match(_start(package / path, _MAX_SHEBANG))):
            found.append(path)
    return found


def _rank(path: str, course: Course) -> tuple[int, str]:
    """Return the place in the order of reading: first the contract's files, then the rest of its folders."""
    if path in course.layout:
        return 0, path
    return (1 if path.split("/")[0] in (course.package, *_FOLDERS) else 2), path


def _start(path: Path, length: int) -> bytes:
    with path.open("rb") as stream:
        return stream.read(length)


def package_files(package: Path, course: Course) -> list[str]:
    """Return the paths of the package's own files, "/" between folders, without caches, build trees and tools' folders.

    Other folders with a leading dot belong to the package: the dot hides them from people, not from the build.
    """
    found = []
    for here, folders, names in os.walk(package):
        folders[:] = sorted(name for name in folders if not (tool_folder(name) or build_tree(Path(here, name))))
        if Path(here) == package:
            folders[:] = [name for name in folders if not _is_of_tools(package / name, course)]
        for name in names:
            path = Path(here, name)
            if path.is_file() and not path.is_symlink():
                found.append(path.relative_to(package).as_posix())
    return sorted(found)


def _is_of_tools(folder: Path, course: Course) -> bool:
    """Return whether a folder at the top of the package is made by a tool, as virtual environments are."""
    if folder.name in (course.package, *_FOLDERS):
        return False
    return folder.name in _OF_TOOLS or (folder / "pyvenv.cfg").is_file()


def copy(sources: list[PythonFile], folder: Path) -> list[PythonFile]:
    """Copy the readable sources below `folder`, and return all sources with their copies' paths.

    Each goes into a folder of its own, under its own name without odd characters, to keep the tools' output readable.
    """
    copied = []
    for number, source in enumerate(sources):
        if source.problem:
            copied.append(source)
            continue
        # Linters skip some names, such as "CVS"; none of those ends with ".py".
        name = re.sub(r"[^\w.]", "_", Path(source.path).name, flags=re.ASCII)[-80:].removesuffix(".py") + ".py"
        place = folder / f"{number:04}" / name
        place.parent.mkdir()
        place.write_bytes(source.data)
        copied.append(replace(source, copy=f"{number:04}/{name}"))
    return copied


def _problem(data: bytes) -> str:
    if len(data) > reading_limits.MAX_BYTES:
        return reading_limits.TOO_LARGE
    if b"\0" in data:
        return "contains NUL bytes, so it is not text"
    try:
        encoding, _ = tokenize.detect_encoding(BytesIO(data).readline)
        data.decode(encoding)
    except (SyntaxError, UnicodeDecodeError, LookupError):
        return "is not text in UTF-8 or in the encoding that it declares"
    if _depth(data) > reading_limits.MAX_DEPTH:
        return reading_limits.TOO_DEEP
    return ""


def _depth(data: bytes) -> int:
    """Return an upper bound of how deep brackets nest: those in strings count, too."""
    deepest = depth = 0
    for byte in re.findall(rb"[()\[\]{}]", data):
        depth = depth + 1 if byte in b"([{" else max(0, depth - 1)
        deepest = max(deepest, depth)
    return deepest
