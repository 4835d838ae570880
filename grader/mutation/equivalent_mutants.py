"""The decoys: changes of a source that change nothing it does. A test that fails on one judges something else.

A decoy stands where a fault could stand and looks like one: a number, a comparison, a condition, a call, a name. What
a module does, returns, raises and publishes stays the same; its bytes, its hash and its syntax tree differ.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from functools import lru_cache

from grader.mutation.source_text import MODULE, Change, Source, Spot
from grader.python_ast import TOO_COMPLEX, Function, called, is_docstring

WEAK = "weak decoy"
"""Another text with the same bytecode: taken where there is no other decoy."""

_MIRRORED: dict[type[ast.cmpop], str] = {
    ast.Lt: ">", ast.LtE: ">=", ast.Gt: "<", ast.GtE: "<=", ast.Eq: "==", ast.NotEq: "!=",
}  # fmt: skip


@lru_cache(maxsize=64)  # they are asked for after every round; the modules of a few packages
def equivalent_mutants(source: Source) -> list[Change]:
    """Return every decoy that could be put into a source, in its order; none for one that is too much for Python."""
    try:
        return [change for spot in source.spots() for change in _decoys(source, spot) if source.reads(change)]
    except TOO_COMPLEX:
        return []


def _decoys(source: Source, spot: Spot) -> Iterator[Change]:
    yield from _number(source, spot)
    yield from _comparison(source, spot)
    yield from _condition(source, spot)
    yield from _statement(source, spot)
    yield from _local_name(source, spot)


def _number(source: Source, spot: Spot) -> Iterator[Change]:
    """0.5 as 0.25 + 0.25, which is the same to the last bit."""
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
    yield source.change(spot, "decoy", f"`{source.text_of(node)}` was written as `{new}`", new)


def _comparison(source: Source, spot: Spot) -> Iterator[Change]:
    """`a < b` as `b > a`."""
    node = spot.node
    if not isinstance(node, ast.Compare) or len(node.ops) != 1 or type(node.ops[0]) not in _MIRRORED:
        return
    left, right = node.left, node.comparators[0]
    if _is_plain(left) and _is_plain(right):
        new = f"({source.text_of(right)} {_MIRRORED[type(node.ops[0])]} {source.text_of(left)})"
        yield source.change(spot, "decoy", f"`{source.text_of(node)}` was written as `{new}`", new)


def _condition(source: Source, spot: Spot) -> Iterator[Change]:
    """`if a:` as `if [a][0]:`; Python itself would take a double `not` out again."""
    node = spot.node
    if isinstance(spot.parent, ast.If | ast.IfExp) and node is spot.parent.test:
        text = source.text_of(node)
        yield source.change(spot, "decoy", f"`{_short(text)}` was put into a list and taken out again", f"[{text}][0]")


def _statement(source: Source, spot: Spot) -> Iterator[Change]:
    """A statement with a `pass` before it, a call kept in a list, an assignment in brackets, an answer with a name."""
    node = spot.node
    if spot.function == MODULE or spot.function_node is None or not isinstance(node, ast.stmt) or is_docstring(node):
        return
    if isinstance(node, ast.Expr) and isinstance(node.value, ast.Call):
        text = source.text_of(node)
        yield source.change(spot, "decoy", f"`{_short(text)}` was kept in a list", f"[{text}]")
    if isinstance(node, ast.Assign | ast.Return | ast.Expr | ast.AugAssign) and not _shares_line(spot, node):
        text = source.text_of(node)
        yield source.change(spot, WEAK, f"a `pass` stands before `{_short(text)}`", f"pass; {text}")
    if isinstance(node, ast.Return) and node.value is not None and not _shares_line(spot, node):
        value = source.text_of(node.value)
        name = _free_name(source)
        yield source.change(
            spot, "decoy", f"`{_short(source.text_of(node))}` got a name first", f"{name} = ({value}); return {name}"
        )


def _local_name(source: Source, spot: Spot) -> Iterator[Change]:
    """A local variable with another name: the whole function, rewritten in one piece."""
    node = spot.node
    if not isinstance(node, Function):
        return
    inner = [n for statement in node.body for n in ast.walk(statement)]
    if any(
        isinstance(n, Function | ast.Lambda | ast.ClassDef | ast.Global | ast.Nonlocal | ast.JoinedStr) for n in inner
    ):
        return
    if any(isinstance(n, ast.Name) and n.id in ("locals", "vars", "eval", "exec", "dir") for n in inner):
        return
    stored = [n.id for n in inner if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)]
    known = {a.arg for a in [*node.args.args, *node.args.kwonlyargs, *node.args.posonlyargs]}
    for name in sorted(set(stored) - known):
        if name.startswith("__") or any(isinstance(n, ast.ExceptHandler) and n.name == name for n in inner):
            continue
        uses = sorted(source.span(n) for n in inner if isinstance(n, ast.Name) and n.id == name)
        if any(isinstance(n, ast.alias | ast.MatchAs | ast.MatchStar) for n in inner):
            continue
        start, end = source.span(node.body[0])[0], source.span(node.body[-1])[1]
        new, at = "", start
        for first, last in uses:
            new, at = new + source.piece(at, first) + _free_name(source, name), last
        changed = new + source.piece(at, end)
        first_statement = Spot(node.body[0], (*spot.parents, node), node.body[0], spot.function)
        yield source.change(first_statement, "decoy", f"the local name `{name}` was changed", changed, (start, end))
        return


def _is_plain(node: ast.AST) -> bool:
    """Return whether the order in which an expression is worked out cannot matter."""
    allowed = (
        ast.Name, ast.Attribute, ast.Constant, ast.UnaryOp, ast.BinOp, ast.operator, ast.unaryop, ast.expr_context,
    )  # fmt: skip
    return all(isinstance(part, allowed) for part in ast.walk(node))


def _in_pattern(spot: Spot) -> bool:
    return any(isinstance(node, ast.pattern) for node in spot.parents)


def _shares_line(spot: Spot, node: ast.stmt) -> bool:
    """Return whether a statement stands on the line of the one it belongs to: `if x: return`."""
    above = spot.parent
    return getattr(above, "lineno", 0) == node.lineno or called(above) != ""


def _free_name(source: Source, base: str = "answer") -> str:
    """Return a name that the module does not use."""
    number = 2
    while f"{base}{number}" in source.names:
        number += 1
    return f"{base}{number}"


def compiles(source: Source, change: Change) -> bool:
    """Return whether Python compiles the module with the change made, as it does what it can read nearly always."""
    try:
        compile(source.apply(change), "decoy", "exec")
    except (SyntaxError, ValueError):
        return False
    return True


def _short(text: str) -> str:
    text = " ".join(text.split())
    return text if len(text) <= 60 else text[:57] + "..."
