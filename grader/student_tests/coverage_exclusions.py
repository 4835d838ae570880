"""The `if`s of a module that no test can be asked to enter, by its syntax tree: a comment or a string is none."""

from __future__ import annotations

import ast

from grader.python_ast import parse

# Whoever puts more than this behind a guard has put the package's code there, to be counted like any other.
_TYPING_ONLY = (ast.Import, ast.ImportFrom, ast.Pass)
_CODE = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef, ast.Lambda)
_TYPE_CHECKING = ("TYPE_CHECKING", "typing.TYPE_CHECKING")


def is_guard(statement: ast.AST) -> bool:
    """Return whether it is `if __name__ == '__main__':` or `if TYPE_CHECKING:` around imports, with no `else`."""
    if not isinstance(statement, ast.If) or statement.orelse:
        return False
    test = statement.test
    if isinstance(test, ast.Compare):
        return ast.unparse(test) == "__name__ == '__main__'" and not any(
            isinstance(n, _CODE) for n in ast.walk(statement)
        )
    if isinstance(test, ast.Name | ast.Attribute) and ast.unparse(test) in _TYPE_CHECKING:
        return all(isinstance(inner, _TYPING_ONLY) for inner in statement.body)
    return False


def guarded_lines(text: str) -> set[int]:
    """Return the lines of a module's guards, which stand at its top level only."""
    tree = parse(text)
    guards = [statement for statement in tree.body if is_guard(statement)] if tree else []
    return {line for guard in guards for line in range(guard.lineno, (guard.end_lineno or guard.lineno) + 1)}
