"""Helpers over `ast` for Python that has not been vetted. Nothing here knows the assignment."""

from __future__ import annotations

import ast
import threading
import warnings
from typing import TypeGuard

BODIES = ("body", "handlers", "orelse", "finalbody", "cases")
"""The fields in which a statement holds others."""

Function = ast.FunctionDef | ast.AsyncFunctionDef

TOO_COMPLEX = (ValueError, RecursionError, MemoryError)
"""What `ast` raises on valid but excessive code: numbers of 5000 digits, sums of 700 terms, 400 times `elif`."""

UNPARSABLE = (SyntaxError, *TOO_COMPLEX)


# Before 3.11.8 and 3.12.2 Python counts the depth of a tree in a place that all threads share, and now and then raises
# a SystemError where two of them parse (gh-106905). Warnings are filtered for all threads, too.
_ONE_AT_A_TIME = threading.RLock()  # a finalizer may come to parse as well
# Anything more than this under `if TYPE_CHECKING` is the package's own code and counts like any other.
_TYPING_ONLY = (ast.Import, ast.ImportFrom, ast.Pass)
_CODE = (Function, ast.ClassDef, ast.Lambda)
_TYPE_CHECKING = ("TYPE_CHECKING", "typing.TYPE_CHECKING")


def tree_of(text: str | bytes) -> ast.Module:
    """Return the syntax tree of a module. Warnings are silenced, and a byte order mark is skipped, as Python does.

    Raises:
        SyntaxError, ValueError, RecursionError, MemoryError: Python cannot parse it; see UNPARSABLE.
    """
    with _ONE_AT_A_TIME, warnings.catch_warnings():
        warnings.simplefilter("ignore")  # a stray "\d" in a string is a matter for the linter
        return ast.parse(text.removeprefix("\ufeff") if isinstance(text, str) else text)


def parse(text: str | bytes) -> ast.Module | None:
    """Return the syntax tree of a module, None if Python cannot parse it."""
    try:
        return tree_of(text)
    except UNPARSABLE:
        return None


def last_name(node: ast.AST) -> str:
    """Return "c" for `a.b.c` and for `c`, "" for anything else."""
    if isinstance(node, ast.Attribute):
        return node.attr
    return node.id if isinstance(node, ast.Name) else ""


def called(node: ast.AST) -> str:
    """Return the last name of what a call calls ("c" for `a.b.c()`), "" for anything else."""
    return last_name(node.func) if isinstance(node, ast.Call) else ""


def argument(call: ast.Call, position: int, *names: str) -> ast.expr | None:
    """Return an argument of a call, given by position or by one of its names; None if there is none."""
    for keyword in call.keywords:
        if keyword.arg in names:
            return keyword.value
    before = call.args[: position + 1]
    if len(before) <= position or any(isinstance(item, ast.Starred) for item in before):
        return None
    return before[position]


def literal_string(node: ast.AST | None) -> str:
    """Return the value of a string literal, "" for anything else."""
    return node.value if isinstance(node, ast.Constant) and isinstance(node.value, str) else ""


def inner(node: ast.AST) -> list[ast.AST]:
    """Return the statements inside a compound statement, in the order of the text."""
    parts = (getattr(node, name, None) for name in BODIES)
    return [node for part in parts if isinstance(part, list) for node in part]


def is_docstring(node: ast.AST) -> bool:
    """Return whether a statement is a bare string."""
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)


def is_test(node: ast.AST) -> TypeGuard[Function]:
    """Return whether a node is a function that pytest collects as a test; a fixture may be called test_node."""
    if not isinstance(node, Function) or not node.name.startswith("test"):
        return False
    parts = (part for decorator in node.decorator_list for part in ast.walk(decorator))
    return not any(last_name(part) == "fixture" for part in parts)


def first_line(node: ast.stmt) -> int:
    """Return the line on which a statement begins, its decorators included."""
    decorators: list[ast.expr] = getattr(node, "decorator_list", [])
    return min([node.lineno, *(decorator.lineno for decorator in decorators)])


def is_guard(statement: ast.AST) -> bool:
    """Return whether it is `if __name__ == '__main__':` or `if TYPE_CHECKING:` around imports, with no `else`."""
    if not isinstance(statement, ast.If) or statement.orelse:
        return False
    test = statement.test
    if isinstance(test, ast.Compare):
        return ast.unparse(test) == "__name__ == '__main__'" and not any(
            isinstance(node, _CODE) for node in ast.walk(statement)
        )
    if isinstance(test, ast.Name | ast.Attribute) and ast.unparse(test) in _TYPE_CHECKING:
        return all(isinstance(inner, _TYPING_ONLY) for inner in statement.body)
    return False
