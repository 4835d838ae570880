"""How much of a package is read, and the words for files beyond that.

A student's module has a few hundred lines and a package a few thousand. Code beyond a limit is not read. A single file
that is too large counts like one that cannot be read: against its package, by its lines. Where a package as a whole is
too large nobody knows what else there is, so it gets no points for its code.
"""

from __future__ import annotations

from collections.abc import Sequence

from grader.evidence.quality import SourceFile

MAX_FILES = 200
MAX_BYTES = 256 * 1024
MAX_TOTAL_BYTES = 1024 * 1024
MAX_DEFINITIONS = 2000
MAX_DEPTH = 100  # of brackets

# The density of findings is per line of code. Without these limits, lines that are cheap to make would dilute it.
MAX_CONSTANT_LINES = 200  # of a whole package: the lines that only give names to constants
MAX_FILE_LINES = 1000
MAX_LINES = 5000  # the reference has 1700, tests included

TOO_LARGE = f"is larger than {MAX_BYTES // 1024} KB, so it is not read: put data into a file of another kind"
TOO_DEEP = f"nests brackets more than {MAX_DEPTH} deep"
TOO_HARD = "made the tools run out of time or memory"
TOO_MANY = f"exceeds the reading limit of {MAX_FILES} Python files in the package"
TOO_MUCH = f"exceeds the reading limit of {MAX_TOTAL_BYTES // 1024} KB of Python in the package"
TOO_PUBLIC = f"exceeds the reading limit of {MAX_DEFINITIONS} public definitions in the package"


def runs_unread(file: SourceFile) -> bool:
    """Return whether Python may well run a file that is not read; one with a syntax error it cannot run either."""
    return file.problem in (TOO_LARGE, TOO_DEEP, TOO_HARD)


def beyond(files: Sequence[SourceFile]) -> list[str]:
    """Return a sentence for each file at which the package exceeds a limit."""
    return [f"{file.path} {file.problem}" for file in files if file.problem in (TOO_MANY, TOO_MUCH, TOO_PUBLIC)]


def counted_lines(files: Sequence[SourceFile]) -> int:
    """Return the number of lines of code over which the density of findings is taken."""
    # A file that cannot be read counts against its package by its lines, so all of them are in the sum.
    lines = (file.lines if file.problem else min(file.lines, MAX_FILE_LINES) for file in files)
    return min(sum(lines), MAX_LINES)
