"""The last hint of an exercise, all but its last line: it appears once the exercise has been tried and was not right.

A student edition has these hints in `.hints/NN_topic.json` and not on its pages. In the kernel `began` finds that of
the exercise that a cell holds; tables, checks, matrices and commands tell `tried` how it went; and `due` is the hint to
show below the cell in which it failed.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from grader.notebook import before_begin, pieces
from grader.notebook.workspace import course

FOLDER = ".hints"  # which JupyterLab does not list
PLACE = "It appears below the next table, check or test of yours that is not right yet."
"""What stands in the fold of a hint that is not there yet."""

FOLD = re.compile(r"(<details><summary>Hint \d[^\n]*\ball but\b[^\n]*</summary>)(.*?)(</details>)", re.DOTALL)
"""A last hint on a page: the line that opens it, the hint, and its end."""
_MAGIC = re.compile(rf"^%%({'|'.join((pieces.MAGIC, *before_begin.WRITES))}) +(?:-\S+ +)*(\S+)", re.MULTILINE)
PYTEST = re.compile(r"^!.*\bpytest\b", re.MULTILINE)
"""A command that runs pytest; a cell that writes a test has the word, too."""
_FUNCTION = re.compile(r"^ {0,4}(?:async +)?def +(\w+)", re.MULTILINE)


def written(cell: str) -> frozenset[str]:
    """Return what a cell writes: a file, or functions of a file, or functions of the notebook."""
    magic = _MAGIC.search(cell)
    if magic and magic[1] != pieces.MAGIC:
        return frozenset({magic[2]})
    return frozenset(f"{magic[2]}:{name}" if magic else name for name in _FUNCTION.findall(cell))


@dataclass
class _Standing:
    """The hint of the last exercise, "" if it has none, what it writes, and whether its last try has failed."""

    hint: str = ""
    names: frozenset[str] = frozenset()
    has_failed: bool = False


_NOW = _Standing()


def began(cell: str, notebook: str) -> None:
    """Note the exercise that a cell of a notebook ("05") holds; one that holds none leaves the last one in force."""
    _NOW.has_failed = False
    names, known = written(cell), _of(notebook)
    hint = next((known[name] for name in sorted(names & known.keys())), "")
    if hint or _MAGIC.search(cell):
        _NOW.hint, _NOW.names = hint, names


def tried(right: bool) -> None:
    """Note how a try went: once it is right, the hint is not needed any more."""
    _NOW.has_failed |= not right
    if right and not _NOW.has_failed:
        _NOW.hint = ""


def tried_by_pytest(package: Path) -> None:
    """Note how the tests that the exercise wrote went, by what pytest has kept of its last run in the package."""
    file = package / ".pytest_cache" / "v" / "cache" / "lastfailed"
    failed: Iterable[str] = ()
    with suppress(OSError, ValueError):
        failed = json.loads(file.read_text(encoding="utf-8"))
    functions = (re.split(r"::|\[", test, maxsplit=2) for test in failed)  # "test/test_motion.py::test_it[0.5]"
    tried(_NOW.names.isdisjoint(":".join(parts[:2]) for parts in functions))


def due() -> str:
    """Return the hint to show below this cell, in Markdown; "" if nothing was tried in it, or all was right."""
    return _NOW.hint if _NOW.has_failed else ""


def _of(notebook: str) -> Mapping[str, str]:
    found: dict[str, str] = {}
    for file in sorted((course().notebooks / FOLDER).glob(f"{notebook}_*.json")) if notebook else ():
        found |= json.loads(file.read_text(encoding="utf-8"))
    return found


def file_of(name: str, notebooks: Path) -> Path:
    """Return the file with the hints of the notebook `name` ("05_moving_safely") of a folder of notebooks."""
    return notebooks / FOLDER / f"{name}.json"
