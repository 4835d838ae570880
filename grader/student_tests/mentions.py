"""What test files mention that no honest test needs: the means to look behind the package or the grader. Text only.

A mention is no proof and costs no points: it tells an instructor where to look.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

from grader.evidence import Flag
from grader.student_tests.discover import FOLDERS, parse

_ATTRIBUTES = {
    "__code__", "co_code", "co_consts", "addaudithook", "settrace", "getsource", "getsourcelines", "get_objects",
}  # fmt: skip
_MODULES = {"marshal", "dis", "linecache", "__main__"}
# Words that mean something else elsewhere, with the module from which they mean this.
_OF_MODULES = {("ast", "parse"), *(("inspect", name) for name in ("getsource", "getsourcelines", "findsource"))}
_OURS = re.compile(r"(?<![\w~.-])/ws/")  # the folders behind the wall, not those of a workspace
_AT_MOST = 20


def mentions(package: Path) -> list[Flag]:
    """Return a flag for each line of a test file that mentions such a thing."""
    found: dict[tuple[str, int], str] = {}
    for path in sorted(path for folder in FOLDERS for path in (package / folder).rglob("*.py") if path.is_file()):
        tree = parse(path)
        for node in ast.walk(tree) if tree is not None else ():
            for what in _mentioned(node):
                found.setdefault((str(path.relative_to(package)), getattr(node, "lineno", 1)), what)
    words = "a test mentions {}, which says nothing of what the package does"
    return [
        Flag("test source", words.format(what), where=f"{path}:{line}")
        for (path, line), what in sorted(found.items())[:_AT_MOST]
    ]


def _mentioned(node: ast.AST) -> Iterator[str]:
    if isinstance(node, ast.Import):
        yield from (alias.name for alias in node.names if alias.name in _MODULES)
    elif isinstance(node, ast.ImportFrom):
        names = [alias.name for alias in node.names]
        if node.module in _MODULES:
            yield str(node.module)
        yield from (f"{node.module}.{name}" for name in names if (node.module, name) in _OF_MODULES)
        yield from (name for name in names if name in _ATTRIBUTES)
    elif isinstance(node, ast.Attribute):
        if node.attr in _ATTRIBUTES or node.attr == "__main__":
            yield node.attr
        elif isinstance(node.value, ast.Name) and (node.value.id, node.attr) in _OF_MODULES:
            yield f"{node.value.id}.{node.attr}"
    elif isinstance(node, ast.Subscript | ast.Call):
        # sys.modules['__main__'], import_module('marshal'), getattr(function, '__code__')
        inside = [node.slice] if isinstance(node, ast.Subscript) else node.args
        by_name = isinstance(node, ast.Subscript) or _called(node) in (
            "import_module",
            "__import__",
            "getattr",
            "setattr",
        )
        for part in inside if by_name else ():
            if isinstance(part, ast.Constant) and part.value in _ATTRIBUTES | _MODULES - {"dis"}:
                yield str(part.value)
    elif isinstance(node, ast.Constant) and isinstance(node.value, str) and _OURS.search(node.value):
        yield "/ws/"


def _called(node: ast.Call) -> str:
    return node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
