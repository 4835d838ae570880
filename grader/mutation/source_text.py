"""Change a Python source at one place and keep all other bytes. Text in, text out: nothing is run."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property

from grader.python_ast import TOO_COMPLEX, UNPARSABLE, Function, called, is_docstring, is_guard, tree_of

MODULE = "<module>"

# What a node logs is for people, not for other nodes: a change there alters no behaviour that a test should pin down.
_LOGGING = {"debug", "info", "warn", "warning", "error", "fatal", "critical", "exception", "log", "print", "get_logger"}
# Waiting longer or queueing more is not a mistake.
_WAITING = {"timeout_sec", "timeout", "num_threads", "depth", "queue_size", "history", "description", "ndigits"}


@dataclass(frozen=True)
class Change:
    """One place of a source and the text put there instead.

    `lines` are the first and last line of the statement, `start` and `end` are in bytes. `operator` is the kind of
    change, `words` describe it to a reader.
    """

    path: str
    line: int
    lines: tuple[int, int]
    function: str
    operator: str
    words: str
    start: int
    end: int
    new: str


@dataclass(frozen=True)
class Spot:
    """A node of the syntax tree that may be changed, and where it is."""

    node: ast.AST
    parents: tuple[ast.AST, ...]
    statement: ast.stmt
    function: str

    @property
    def parent(self) -> ast.AST:
        """Return the node above."""
        return self.parents[-1]

    @property
    def function_node(self) -> Function | None:
        """Return the innermost function around the node, None outside functions."""
        return next((node for node in reversed(self.parents) if isinstance(node, Function)), None)


@dataclass(eq=False)
class SourceText:
    """One module of a package: its text, its tree, and the places in it that decide behaviour."""

    path: str
    text: str
    tree: ast.Module = field(init=False)

    def __post_init__(self) -> None:
        self.tree = tree_of(self.text)
        self._bytes = self.text.encode()
        self._starts = [0]
        for line in self._bytes.splitlines(keepends=True):
            self._starts.append(self._starts[-1] + len(line))

    @cached_property
    def names(self) -> frozenset[str]:
        """The names of all variables and parameters in the module."""
        nodes = [node for node in ast.walk(self.tree) if isinstance(node, ast.Name | ast.arg)]
        return frozenset(node.id if isinstance(node, ast.Name) else node.arg for node in nodes)

    def spots(self) -> Iterator[Spot]:
        """Yield the nodes that decide behaviour: no annotations, docstrings, messages, log lines or imports."""
        yield from _walk(self.tree, (), None, MODULE)

    def span(self, node: ast.AST) -> tuple[int, int]:
        """Return where a node starts and ends, in bytes."""
        first, last = node.lineno, node.end_lineno  # type: ignore[attr-defined]
        return self._starts[first - 1] + node.col_offset, self._starts[last - 1] + node.end_col_offset  # type: ignore[attr-defined]

    def piece(self, start: int, end: int) -> str:
        """Return the text between two offsets in bytes."""
        return self._bytes[start:end].decode()

    def text_of(self, node: ast.AST) -> str:
        """Return a node's text."""
        return self.piece(*self.span(node))

    def short_text_of(self, node: ast.AST) -> str:
        """Return a node's text on one line, at most 60 characters of it."""
        return shorten(self.text_of(node))

    def change(self, spot: Spot, operator: str, words: str, new: str, where: tuple[int, int] | None = None) -> Change:
        """Return the change that puts `new` in the place of the spot, or of `where` in it (offsets in bytes)."""
        start, end = where or self.span(spot.node)
        first, last = header(spot.statement)
        line = getattr(spot.node, "lineno", first)
        return Change(self.path, line, (first, last), spot.function, operator, words, start, end, new)

    def apply(self, change: Change) -> str:
        """Return the text with the change made."""
        return (self._bytes[: change.start] + change.new.encode() + self._bytes[change.end :]).decode()

    def compiles(self, change: Change) -> bool:
        """Return whether Python compiles the module with the change made: nearly always."""
        try:
            compile(self.apply(change), "mutant", "exec")
        except UNPARSABLE:
            return False
        return True


def parse(path: str, text: str) -> SourceText | None:
    """Return the source, None if Python cannot parse it."""
    try:
        return SourceText(path, text)
    except UNPARSABLE:
        return None


def is_too_complex(text: str) -> bool:
    """Return whether Python finds no error in a text and yet cannot show its tree: it may well run it."""
    try:
        tree_of(text)
    except SyntaxError:
        return False
    except TOO_COMPLEX:
        return True
    return False


def shorten(text: str) -> str:
    """Return a text on one line, at most 60 characters of it."""
    text = " ".join(text.split())
    return text if len(text) <= 60 else text[:57] + "..."


def header(statement: ast.stmt) -> tuple[int, int]:
    """Return the lines of a statement, without the statements in it."""
    body = getattr(statement, "body", None)
    last = statement.end_lineno or statement.lineno
    if isinstance(body, list) and body:
        last = max(statement.lineno, body[0].lineno - 1)
    return statement.lineno, last


def _walk(node: ast.AST, parents: tuple[ast.AST, ...], statement: ast.stmt | None, function: str) -> Iterator[Spot]:
    for name, child in _children(node):
        if _is_silent(child) or (isinstance(node, ast.While) and name == "test"):
            continue
        if isinstance(node, ast.Module) and is_guard(child):
            continue
        inside, here, trail = function, statement, (*parents, node)
        if isinstance(child, ast.stmt):
            here = child
            if isinstance(child, Function | ast.ClassDef):
                inside = child.name if function == MODULE else f"{function}.{child.name}"
        if here is not None:
            yield Spot(child, trail, here, inside)
        yield from _walk(child, trail, here, inside)


def _children(node: ast.AST) -> Iterator[tuple[str, ast.AST]]:
    for name, value in ast.iter_fields(node):
        if name in ("annotation", "returns", "decorator_list", "bases", "keywords_", "type_comment", "format_spec"):
            continue
        for child in value if isinstance(value, list) else [value]:
            if isinstance(child, ast.AST):
                yield name, child


def _is_silent(node: ast.AST) -> bool:
    """Return whether a node and all below it are left alone."""
    if isinstance(node, ast.Import | ast.ImportFrom | ast.Raise | ast.Assert | ast.JoinedStr | ast.Global):
        return True
    if is_docstring(node) or called(node) in _LOGGING:
        return True
    if isinstance(node, Function) and node.name in ("__repr__", "__str__", "__del__"):
        return True
    if isinstance(node, ast.keyword) and node.arg in _WAITING:
        return True
    if isinstance(node, ast.Assign):
        return any(re.search(r"__all__|message$|reason$|_text$|\b__path__", ast.unparse(t)) for t in node.targets)
    return False
