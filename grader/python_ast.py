"""Helpers over `ast` for Python that nobody has vetted. Nothing here knows the assignment."""

from __future__ import annotations

import ast
import warnings

Function = ast.FunctionDef | ast.AsyncFunctionDef

TOO_COMPLEX = (ValueError, RecursionError, MemoryError)
"""What `ast` raises on valid but excessive code: numbers of 5000 digits, sums of 700 terms, 400 times `elif`."""

UNPARSABLE = (SyntaxError, *TOO_COMPLEX)


def parse(text: str | bytes) -> ast.Module | None:
    """Return the syntax tree of a module, None if Python cannot parse it. Warnings are silenced."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # a stray "\d" in a string is a matter for the linter
            return ast.parse(text)
    except UNPARSABLE:
        return None


def called(node: ast.AST) -> str:
    """Return the last name of what a call calls ("c" for `a.b.c()`), "" for anything else."""
    if not isinstance(node, ast.Call):
        return ""
    return node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")


def is_docstring(node: ast.AST) -> bool:
    """Return whether a statement is a bare string."""
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)


def first_line(node: ast.stmt) -> int:
    """Return the line on which a statement begins, its decorators included."""
    return min([node.lineno, *(decorator.lineno for decorator in getattr(node, "decorator_list", ()))])
