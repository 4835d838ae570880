"""The `if`s of a module that no test can be expected to enter, found in the syntax tree, not in comments or strings."""

from __future__ import annotations

import ast

from grader.python_ast import TOO_COMPLEX, Function, parse

# Anything more than this under `if TYPE_CHECKING` is the package's own code and counts like any other.
_TYPING_ONLY = (ast.Import, ast.ImportFrom, ast.Pass)
_CODE = (Function, ast.ClassDef, ast.Lambda)
_TYPE_CHECKING = ("TYPE_CHECKING", "typing.TYPE_CHECKING")


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


def guarded_lines(text: str) -> set[int]:
    """Return the lines of a module's guards; only those at its top level count."""
    tree = parse(text)
    try:
        guards = [statement for statement in tree.body if is_guard(statement)] if tree else []
    except TOO_COMPLEX:  # a condition that can be parsed and not written out
        return set()
    return {line for guard in guards for line in range(guard.lineno, (guard.end_lineno or guard.lineno) + 1)}
