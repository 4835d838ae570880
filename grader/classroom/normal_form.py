"""Python as a text that says what is done: without names, comments, strings, imports and statements that do nothing."""

from __future__ import annotations

import ast
import io
import keyword
import tokenize
from collections.abc import Iterator, Sequence
from copy import copy

from grader import python_ast
from grader.python_ast import BODIES, inner

_STRINGS = {tokenize.STRING, getattr(tokenize, "FSTRING_START", tokenize.STRING)}
_ACTS = ast.Call | ast.Await | ast.Yield | ast.YieldFrom | ast.NamedExpr
_PURE = {"bool", "dict", "float", "id", "int", "len", "list", "set", "str", "tuple", "type"}
_MORE_THAN_A_NAME = ""
_ROUNDS = 50  # each finds what the last round's statements depend on; what people write takes five or so
_Assignment = ast.Assign | ast.AnnAssign | ast.AugAssign


def normal_form(text: str) -> list[tuple[str, int]] | None:
    """Return each statement, the head alone of one that holds others, with its line; None if Python cannot parse it."""
    try:
        tree = python_ast.tree_of(text)
        needed = {_MORE_THAN_A_NAME}
        for _ in range(_ROUNDS):
            done = list(_what_is_done(tree, needed))
            if not (more := {name for head in done for name in _names(head)} - needed):
                break
            needed |= more
        return [("".join(map(_sign, _tokens(head))), getattr(head, "lineno", 1)) for head in done]
    except python_ast.UNPARSABLE:
        return None


def _what_is_done(tree: ast.Module, needed: set[str]) -> Iterator[ast.AST]:
    """Yield the heads of the statements that do something, where nothing depends on other names than the `needed`."""
    todo: list[ast.AST] = [tree]
    while todo:
        node = todo.pop()
        if not isinstance(node, ast.stmt) or not _is_idle(node, needed):
            head = copy(node)
            for name in BODIES:
                if hasattr(head, name):
                    setattr(head, name, [])
            yield head
            todo += reversed(inner(node))


def _tokens(head: ast.AST) -> Iterator[tokenize.TokenInfo]:
    return tokenize.generate_tokens(io.StringIO(ast.unparse(head)).readline)


def _sign(token: tokenize.TokenInfo) -> str:
    if token.type == tokenize.NAME:
        return token.string if keyword.iskeyword(token.string) else "V"
    return token.string.strip() if token.type in (tokenize.NUMBER, tokenize.OP) else "S" * (token.type in _STRINGS)


def _is_idle(node: ast.stmt, needed: set[str]) -> bool:
    def idle(*bodies: Sequence[ast.stmt]) -> bool:
        return all(_is_idle(part, needed) for body in bodies for part in body)

    match node:
        case ast.Pass() | ast.Import() | ast.ImportFrom() | ast.Global() | ast.Nonlocal():
            return True
        case ast.Expr():
            return not _acts(node.value)
        case ast.Assign(targets=[ast.Name(id=name)], value=ast.Name(id=value)) if name == value:
            return True
        case ast.Assign() | ast.AnnAssign() | ast.AugAssign():
            return not _acts(node) and not needed & _stored(node)
        case ast.If(test=ast.Constant(value=value), orelse=[]) | ast.While(test=ast.Constant(value=value), orelse=[]):
            return not value or (isinstance(node, ast.If) and idle(node.body))
        case ast.If():
            return not _acts(node.test) and idle(node.body, node.orelse)
        case ast.For():
            return not _acts(node.iter) and idle(node.body, node.orelse)
        case ast.Try():
            return idle(node.body, *(handler.body for handler in node.handlers), node.orelse, node.finalbody)
        case ast.FunctionDef(name=name, decorator_list=[]):
            return name not in needed and idle(node.body)
        case ast.Assert(test=ast.Constant(value=value)):
            return bool(value)
    return False


def _acts(node: ast.AST) -> bool:
    """Return whether evaluating this may do more than give a value."""
    calls = (part for part in ast.walk(node) if isinstance(part, _ACTS))
    return any(not (isinstance(c, ast.Call) and isinstance(c.func, ast.Name) and c.func.id in _PURE) for c in calls)


def _stored(node: _Assignment) -> set[str]:
    """Return the names that an assignment sets, and _MORE_THAN_A_NAME if it sets anything else."""
    targets = node.targets if isinstance(node, ast.Assign) else [node.target]
    names = [part for target in targets for part in (target.elts if isinstance(target, ast.Tuple) else [target])]
    return {part.id if isinstance(part, ast.Name) else _MORE_THAN_A_NAME for part in names}


def _names(node: ast.AST) -> Iterator[str]:
    for part in ast.walk(node):
        if isinstance(part, ast.Name) and isinstance(part.ctx, ast.Load):
            yield part.id
        elif isinstance(part, ast.Attribute):
            yield part.attr
