"""Which tests use what one place of the tests' code has read. Read as text, by names; nothing is run.

What is read on import or in a shared fixture is read for some tests of a module, not for all of them.
"""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from grader.python_ast import Function, first_line, is_docstring, is_test, parse
from grader.sandbox import untrusted


@dataclass(frozen=True)
class _Part:
    """A statement at the top of a module, or a test of a class: the names it gives and those it mentions."""

    gives: frozenset[str]
    mentions: frozenset[str]
    for_all: bool
    """Whether what it does concerns every test."""


def users_of(module: Path, where: str, line: int, tests: Sequence[str]) -> frozenset[str] | None:
    """Return which of the `tests` of a module use what the statement at a line has made; None if it cannot be told.

    `where` is the end of the path of the module or of a conftest.py above it.
    """
    places = [module, *(folder / "conftest.py" for folder in module.parents)]
    trees = {path: tree for path in places if (tree := _parse(path)) is not None}
    path = next((path for path in trees if where and path.as_posix().endswith(f"/{where}")), None)
    if module not in trees or path is None:
        return None
    statement = next((item for item in trees[path].body if _covers(item, line)), None)
    names = _given(statement) if statement is not None else set()
    parts = [part for tree in trees.values() for part in _parts(tree)]
    if not names or not _spread(parts, names):
        return None
    defined = _defined(trees[module])
    # Tests of other modules may run beside: the grader's own.
    own = (name for name in tests if module.as_posix().endswith(f"/{name.partition('::')[0]}"))
    return frozenset(name for name in own if (test := _qualified(name)) not in defined or {*_ways(test)} & names)


def _parse(path: Path) -> ast.Module | None:
    text = untrusted.read_python(path) if path.is_file() else None
    return parse(text) if text is not None else None


def _covers(statement: ast.stmt, line: int) -> bool:
    return first_line(statement) <= line <= (statement.end_lineno or statement.lineno)


def _spread(parts: Iterable[_Part], names: set[str]) -> bool:
    """Add the names of what mentions one of the names, and so on. Return False if it comes to concern every test."""
    left = list(parts)
    while touched := [part for part in left if part.mentions & names]:
        if any(part.for_all for part in touched):
            return False
        left = [part for part in left if not part.mentions & names]
        names |= {name for part in touched for name in part.gives}
    return "pytestmark" not in names


def _parts(tree: ast.Module) -> Iterator[_Part]:
    for statement in tree.body:
        if isinstance(statement, ast.ClassDef):
            tests = [item for item in statement.body if is_test(item)]
            rest = [part for part in ast.iter_child_nodes(statement) if part not in tests]
            yield _Part(frozenset({statement.name}), _mentions(*rest), for_all=False)
            for test in tests:
                yield _Part(frozenset({f"{statement.name}.{test.name}"}), _mentions(test), for_all=False)
        elif not is_docstring(statement):
            gives = frozenset(_given(statement))
            yield _Part(gives, _mentions(statement), for_all=not gives or _is_for_all(statement))


def _is_for_all(statement: ast.stmt) -> bool:
    """Return whether a statement is a fixture that every test uses, or may end the import."""
    if isinstance(statement, Function):
        return any(isinstance(part, ast.keyword) and part.arg == "autouse" for part in ast.walk(statement))
    return any(isinstance(part, ast.Raise | ast.Assert) for part in ast.walk(statement))


def _given(statement: ast.stmt) -> set[str]:
    """Return the names through which tests may get at what a statement makes."""
    if isinstance(statement, Function | ast.ClassDef):
        return {statement.name}
    if isinstance(statement, ast.Import | ast.ImportFrom):
        return {(alias.asname or alias.name).partition(".")[0] for alias in statement.names}
    names = _stored(statement) - _inside_comprehensions(statement)
    if isinstance(statement, ast.For | ast.While | ast.With | ast.If | ast.Try):
        # A loop may put what it reads into a list or a dictionary that is there already.
        filled = (n.value for n in ast.walk(statement) if isinstance(n, ast.Subscript | ast.Attribute))
        names |= {n.id for n in filled if isinstance(n, ast.Name)}
    return names


def _mentions(*nodes: ast.AST) -> frozenset[str]:
    found = set[str]()
    for part in (part for node in nodes for part in ast.walk(node)):
        if isinstance(part, ast.Name):
            found.add(part.id)
        elif isinstance(part, ast.arg):  # a fixture
            found.add(part.arg)
        elif isinstance(part, ast.Constant) and isinstance(part.value, str):  # `usefixtures`
            found.add(part.value)
    return frozenset(found.difference(*map(_inside_comprehensions, nodes)))


def _stored(node: ast.AST) -> set[str]:
    return {n.id for n in ast.walk(node) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)}


def _inside_comprehensions(node: ast.AST) -> set[str]:
    """Return the names of the loops in comprehensions: nothing else sees those."""
    return {name for part in ast.walk(node) if isinstance(part, ast.comprehension) for name in _stored(part.target)}


def _defined(tree: ast.Module) -> set[str]:
    """Return the qualified names of the tests that stand in the module's own text."""
    return {name for part in _parts(tree) for name in part.gives}


def _qualified(test: str) -> str:
    """Return "TestA.test_x" for "test/test_a.py::TestA::test_x[1-2]"."""
    return ".".join(test.partition("[")[0].split("::")[1:])


def _ways(test: str) -> Iterator[str]:
    """Yield the names that make a test one of those looked for: its own, and its class's."""
    yield test
    if "." in test:
        yield test.partition(".")[0]
