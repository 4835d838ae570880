"""The most of a package that is read, and the words that say where it goes beyond. Pure, and light: checks use it too.

A student's module has a few hundred lines and a package a few thousand. What goes beyond a bound is not read, and
since nobody can say what stands there, a package that goes beyond one has shown nothing.
"""

from __future__ import annotations

from collections.abc import Sequence

from grader.evidence import SourceFile

MOST_FILES = 200
MOST_BYTES = 256 * 1024
MOST_TOTAL_BYTES = 1024 * 1024
MOST_DEFINITIONS = 2000

# What a density of findings is taken over. More of it would buy findings with lines that are cheap to make.
MOST_CONSTANT_LINES = 200  # of a whole package: the lines that only give names to constants
MOST_FILE_LINES = 1000
MOST_LINES = 5000  # the reference has 1700, tests included

_BEYOND = "goes beyond what is read"

TOO_LARGE = f"{_BEYOND}, {MOST_BYTES // 1024} KB in one file: data belongs into a file of another kind"
TOO_MANY = f"{_BEYOND}, {MOST_FILES} Python files in the package"
TOO_MUCH = f"{_BEYOND}, {MOST_TOTAL_BYTES // 1024} KB of Python in the package"
TOO_PUBLIC = f"{_BEYOND}, {MOST_DEFINITIONS} public definitions in the package"


def beyond(files: Sequence[SourceFile]) -> list[str]:
    """Return a sentence for each file at which the package goes beyond a bound."""
    return [f"{file.path} {file.problem}" for file in files if file.problem.startswith(_BEYOND)]


def counted_lines(files: Sequence[SourceFile]) -> int:
    """Return the lines of code that findings are held against."""
    # A file that cannot be read counts against its package by its lines, so all of them are in the sum.
    lines = (file.lines if file.problem else min(file.lines, MOST_FILE_LINES) for file in files)
    return min(sum(lines), MOST_LINES)
