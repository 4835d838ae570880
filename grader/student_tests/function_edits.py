"""Change the functions of a Python module so that they fail. Text in, text out; all other lines stay as they are."""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Iterable
from functools import lru_cache

from grader.python_ast import Function, first_line, parse


@lru_cache(64)  # each module is asked for again and again: for every test module, and for every probe
def functions_from_the_end(text: str) -> list[Function]:
    """Return the outermost functions and methods of a module, the last first: an edit moves only those after it."""
    tree = parse(text)
    found: list[Function] = []
    waiting: list[ast.AST] = list(tree.body) if tree else []
    for node in waiting:
        if isinstance(node, Function):
            found.append(node)
        elif isinstance(node, ast.ClassDef | ast.If | ast.Try | ast.With):
            waiting += node.body
    return sorted(found, key=lambda function: function.lineno, reverse=True)


def body_lines(function: Function) -> tuple[int, int]:
    """Return the first and last line of a function's body, without its docstring."""
    return first_line(_body(function)[0]), _end(function)


def fail_when_run(text: str, functions: Iterable[tuple[Function, str]]) -> str:
    """Return a module in which functions, given from the end, raise an AssertionError with these messages.

    Each function raises at its end where possible, otherwise at once.
    """
    lines = _split_lines(text)
    for function, message in functions:
        if not _raise_last(lines, function, f"raise AssertionError({message!r})"):
            _replace_body(lines, function, f"raise AssertionError({message!r})")
    return "".join(lines)


def make_raise(text: str, wanted: Callable[[Function], bool]) -> tuple[str, set[int], list[Function]]:
    """Return a module in which the `wanted` functions raise as soon as they are called, the dead lines, and those.

    A function of a single line may be left as it is.
    """
    lines = _split_lines(text)
    dead: set[int] = set()
    made: list[Function] = []
    for function in functions_from_the_end(text):
        first, last = body_lines(function)
        if not wanted(function) or last == function.lineno:
            continue
        if _raise_first(lines, function):
            dead = {line + 1 for line in dead} | set(range(first + 1, last + 2))
        elif last > first:
            _replace_body(lines, function, "raise RuntimeError('not reached')")
            dead |= set(range(first + 1, last + 1))
        else:
            continue
        made.append(function)
    return "".join(lines), dead, made


def _split_lines(text: str) -> list[str]:
    """Return the lines as Python counts them, each ending in a line feed."""
    return [f"{line}\n" for line in re.split(r"\r\n|\r|\n", text)]


def _raise_first(lines: list[str], function: Function) -> bool:
    """Insert a line that raises before a function's body. The body stays, for readers that look which lines there are.

    Return whether that was possible: the body may be on the line of the `def`, or follow a docstring and `;`.
    """
    first, _ = body_lines(function)
    line = lines[first - 1]
    before = line.encode()[: _body(function)[0].col_offset].decode()
    if before.strip() or lines[first - 2].rstrip().endswith("\\"):
        return False
    # Not a `raise`: neither Python nor a reader of the source can tell that this ends the function.
    lines.insert(first - 1, f"{_indent(line)}(_ for _ in ()).throw(RuntimeError('not reached'))\n")
    return True


def _raise_last(lines: list[str], function: Function, new: str) -> bool:
    """Insert a statement after a function's body. Return whether it is certain to be the last one executed there."""
    first = function.body[0]
    indent = _indent(lines[first.lineno - 1])
    leaves = (ast.Return, ast.Yield, ast.YieldFrom)
    if first.lineno == function.lineno or len(indent.encode()) != first.col_offset:
        return False
    if any(isinstance(node, leaves) for node in ast.walk(function)):
        return False
    lines.insert(_end(function), f"{indent}{new}\n")
    return True


def _replace_body(lines: list[str], function: Function, new: str) -> None:
    """Replace a function's body by one statement; all other lines keep their numbers."""
    body = _body(function)
    first, last = body[0].lineno, function.end_lineno or body[-1].lineno
    head = lines[first - 1].encode()[: body[0].col_offset].decode()
    lines[first - 1 : last] = [f"{head}{new}\n", *["\n"] * (last - first)]


def _body(function: Function) -> list[ast.stmt]:
    first = function.body[0]
    is_docstring = isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant)
    return function.body[1:] if is_docstring and len(function.body) > 1 else function.body


def _end(function: Function) -> int:
    return function.end_lineno or function.lineno


def _indent(line: str) -> str:
    return line[: len(line) - len(line.lstrip())]
