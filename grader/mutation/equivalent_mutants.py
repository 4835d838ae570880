"""Equivalent mutants: changes of a source that keep its behaviour. A test that fails on one checks something else.

An equivalent mutant changes what a mutant could change: a number, a comparison, a condition, a call. What a module
does, returns, raises and publishes stays the same; its bytes, its hash and its syntax tree differ.
"""

from __future__ import annotations

import ast
import itertools
from collections.abc import Iterator
from functools import lru_cache

from grader.mutation.source_text import MODULE, Change, SourceText, Spot
from grader.python_ast import TOO_COMPLEX, called, is_docstring

EQUIVALENT = "equivalent"
WEAK = "weakly equivalent"
"""Another text with the same bytecode: chosen only where there is no other equivalent mutant."""

_MIRRORED: dict[type[ast.cmpop], str] = {
    ast.Lt: ">", ast.LtE: ">=", ast.Gt: "<", ast.GtE: "<=", ast.Eq: "==", ast.NotEq: "!=",
}  # fmt: skip


@lru_cache(maxsize=64)  # called after every round; enough for the modules of a few packages
def equivalent_mutants(source: SourceText) -> list[Change]:
    """Return every equivalent mutant of a source, in its order; [] for a source that is too complex for Python."""
    try:
        ways = (_number, _comparison, _condition, _statement)
        return [change for spot in source.spots() for way in ways for change in way(source, spot)]
    except TOO_COMPLEX:
        return []


def _number(source: SourceText, spot: Spot) -> Iterator[Change]:
    """Write 0.5 as 0.25 + 0.25, which is the same to the last bit."""
    node = spot.node
    if not isinstance(node, ast.Constant) or type(node.value) not in (int, float) or _in_pattern(spot):
        return
    value = node.value
    if isinstance(value, float) and 1e-200 < abs(value) < 1e200:
        new = f"({value / 2!r} + {value / 2!r})"
    elif isinstance(value, int) and 0 < value < 10**6:
        new = f"({value - 1} + 1)"
    else:
        return
    yield source.change(spot, EQUIVALENT, f"`{source.text_of(node)}` was written as `{new}`", new)


def _comparison(source: SourceText, spot: Spot) -> Iterator[Change]:
    """Write `a < b` as `b > a`."""
    node = spot.node
    if not isinstance(node, ast.Compare) or len(node.ops) != 1 or type(node.ops[0]) not in _MIRRORED:
        return
    left, right = node.left, node.comparators[0]
    if _is_plain(left) and _is_plain(right):
        new = f"({source.text_of(right)} {_MIRRORED[type(node.ops[0])]} {source.text_of(left)})"
        yield source.change(spot, EQUIVALENT, f"`{source.text_of(node)}` was written as `{new}`", new)


def _condition(source: SourceText, spot: Spot) -> Iterator[Change]:
    """Write `if a:` as `if [a][0]:`; Python itself would remove a double `not`."""
    node = spot.node
    if isinstance(spot.parent, ast.If | ast.IfExp) and node is spot.parent.test:
        words = f"`{source.short_text_of(node)}` was put into a list and taken out again"
        yield source.change(spot, EQUIVALENT, words, f"[{source.text_of(node)}][0]")


def _statement(source: SourceText, spot: Spot) -> Iterator[Change]:
    """Put a call into a list, a `pass` before a statement, or a returned value into a variable."""
    node = spot.node
    if spot.function == MODULE or spot.function_node is None or not isinstance(node, ast.stmt) or is_docstring(node):
        return
    text, short = source.text_of(node), source.short_text_of(node)
    if isinstance(node, ast.Expr) and isinstance(node.value, ast.Call):
        yield source.change(spot, EQUIVALENT, f"`{short}` was put into a list", f"[{text}]")
    if isinstance(node, ast.Assign | ast.Return | ast.Expr | ast.AugAssign) and not _shares_line(spot, node):
        yield source.change(spot, WEAK, f"a `pass` was put before `{short}`", f"pass; {text}")
    if isinstance(node, ast.Return) and node.value is not None and not _shares_line(spot, node):
        name = _free_name(source)
        new = f"{name} = ({source.text_of(node.value)}); return {name}"
        yield source.change(spot, EQUIVALENT, f"the value of `{short}` was put into a variable first", new)


def _is_plain(node: ast.AST) -> bool:
    """Return whether the order of evaluation cannot matter in an expression."""
    allowed = (
        ast.Name, ast.Attribute, ast.Constant, ast.UnaryOp, ast.BinOp, ast.operator, ast.unaryop, ast.expr_context,
    )  # fmt: skip
    return all(isinstance(part, allowed) for part in ast.walk(node))


def _in_pattern(spot: Spot) -> bool:
    return any(isinstance(node, ast.pattern) for node in spot.parents)


def _shares_line(spot: Spot, node: ast.stmt) -> bool:
    """Return whether a statement is on the line of the one it belongs to: `if x: return`."""
    above = spot.parent
    return getattr(above, "lineno", 0) == node.lineno or called(above) != ""


def _free_name(source: SourceText) -> str:
    """Return a name that the module does not use."""
    return next(name for number in itertools.count(2) if (name := f"answer{number}") not in source.names)
