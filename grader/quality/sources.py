"""The Python files of a package as bytes: found, bounded, and copied for tools to read. No judgement, no parsing."""

from __future__ import annotations

import os
import re
import tokenize
from dataclasses import dataclass, replace
from io import BytesIO
from pathlib import Path

# A student's module has a few hundred lines; what goes beyond these is not read, and said so.
MOST_FILES = 200
MOST_BYTES = 256 * 1024
MOST_TOTAL_BYTES = 1024 * 1024
LONGEST_LINE = 2000
DEEPEST_BRACKETS = 100

_NOT_SOURCE = {"__pycache__", "build", "install", "log", "node_modules", "site-packages"}
# A linter that honours suppressions would judge the student's comments, not the code.
_SUPPRESSION = re.compile(
    rb"#.*?(?:\b(noqa)\b|pragma:\s*no\s*cover|type:\s*ignore|pylint:\s*disable|mypy:\s*ignore|ruff:\s*noqa"
    rb"|fmt:\s*(?:off|skip)|nosec\b|(?:isort|yapf):\s*(?:skip|off|disable))",
    re.IGNORECASE,
)
_NOQA = re.compile(rb"noqa", re.IGNORECASE)


@dataclass(frozen=True)
class Source:
    """One Python file. `copy` is where the tools find it; `problem` says why they are not shown it."""

    path: str
    data: bytes
    problem: str = ""
    copy: str = ""

    @property
    def rough_lines(self) -> int:
        """Return the number of lines that are neither blank nor comment, for a file that cannot be parsed."""
        lines = (line.strip() for line in self.data.splitlines())
        return sum(1 for line in lines if line and not line.startswith(b"#"))

    def suppressions(self) -> list[tuple[int, str]]:
        """Return the lines with a comment that would switch a tool off, and the comment."""
        found = []
        for number, line in enumerate(self.data.splitlines(), 1):
            match = _SUPPRESSION.search(line[:LONGEST_LINE])
            if match:
                found.append((number, line[match.start() :].decode("utf-8", "replace").strip()))
        return found


def find(package: Path) -> list[Source]:
    """Return the package's Python files, ordered by path, as far as the bounds allow."""
    found: list[Source] = []
    total = 0
    for path in sorted(package_files(package)):
        if not path.endswith(".py"):
            continue
        if len(found) == MOST_FILES or total > MOST_TOTAL_BYTES:
            found.append(Source(path, b"", problem="not read: the package holds more Python than can be looked at"))
            break
        with (package / path).open("rb") as stream:
            data = stream.read(MOST_BYTES + 1)
        total += len(data)
        found.append(Source(path, data, problem=_problem(data)))
    return found


def package_files(package: Path) -> list[str]:
    """Return the paths of the package's own files, "/" between folders; caches and build trees left out."""
    found = []
    for here, folders, names in os.walk(package):
        folders[:] = sorted(name for name in folders if name not in _NOT_SOURCE and not name.startswith("."))
        if "pyvenv.cfg" in names:
            folders.clear()
            continue
        for name in names:
            path = Path(here, name)
            if path.is_file() and not path.is_symlink():
                found.append(path.relative_to(package).as_posix())
    return sorted(found)


def copy(sources: list[Source], folder: Path) -> list[Source]:
    """Copy the readable sources below `folder`, suppressions spoilt, and return them with their places.

    Each goes into a folder of its own, under its own name without odd characters: what tools print stays readable.
    """
    copied = []
    for number, source in enumerate(sources):
        if source.problem:
            copied.append(source)
            continue
        name = re.sub(r"[^\w.]", "_", Path(source.path).name, flags=re.ASCII)[-80:]
        place = folder / f"{number:04}" / name
        place.parent.mkdir()
        # Some plugins of flake8 look for "noqa" themselves, so switching it off in flake8 is not enough.
        place.write_bytes(b"".join(_without_noqa(line) for line in source.data.splitlines(keepends=True)))
        copied.append(replace(source, copy=f"{number:04}/{name}"))
    return copied


def _without_noqa(line: bytes) -> bytes:
    code, mark, comment = line.partition(b"#")
    return code + mark + _NOQA.sub(b"nqoa", comment)


def _problem(data: bytes) -> str:
    if len(data) > MOST_BYTES:
        return f"larger than {MOST_BYTES // 1024} KB"
    if b"\0" in data:
        return "holds NUL bytes, so it is no text"
    try:
        encoding, _ = tokenize.detect_encoding(BytesIO(data).readline)
        data.decode(encoding)
    except (SyntaxError, UnicodeDecodeError, LookupError):
        return "its bytes are no text in UTF-8 or in the encoding that it declares"
    if max((len(line) for line in data.splitlines()), default=0) > LONGEST_LINE:
        return f"holds a line of more than {LONGEST_LINE} characters"
    if _depth(data) > DEEPEST_BRACKETS:
        return f"nests brackets more than {DEEPEST_BRACKETS} deep"
    return ""


def _depth(data: bytes) -> int:
    """Return how deep brackets nest at most. Those in strings count too, which makes the number an upper bound."""
    deepest = depth = 0
    for byte in re.findall(rb"[()\[\]{}]", data):
        depth = depth + 1 if byte in b"([{" else max(0, depth - 1)
        deepest = max(deepest, depth)
    return deepest
