"""What a course holds back: the names in its folder held_back/, by which a trial, a check or a world could be found.

Students read the title, the text and the points of a requirement with `held_back: true`, and nothing of what judges it.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable
from functools import cache
from pathlib import Path

from grader.course.model import Course


@cache
def names(course: Course) -> frozenset[str]:
    """Return the names of the files that are held back, and of the trials and checks in them."""
    files = [path for path in course.held_back.rglob("*") if path.is_file() and path.suffix != ".pyc"]
    return frozenset(name for path in files for name in (path.stem, *_functions(path)) if name != "__init__")


def words(found: Iterable[str]) -> re.Pattern[str]:
    """Return a pattern for each of these names as a whole word; of none it finds nothing."""
    return re.compile(rf"(?<!\w)(?:{'|'.join(sorted(map(re.escape, found), key=len, reverse=True)) or '(?!)'})(?!\w)")


def _functions(path: Path) -> list[str]:
    body = ast.parse(path.read_text(encoding="utf-8")).body if path.suffix == ".py" else ()
    functions = (node for node in body if isinstance(node, ast.FunctionDef))
    return [node.name for node in functions if node.decorator_list or node.name.startswith("test_")]
