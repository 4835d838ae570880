"""Read a package's test modules as text: which are generated stubs, how many tests there are, what they assert."""

from __future__ import annotations

import ast
import re
from collections.abc import Collection, Container, Iterable, Iterator, Mapping, Sequence
from pathlib import Path

from grader.evidence import Flag, TestModule
from grader.python_ast import TOO_COMPLEX, Function, called, is_test, last_name, parse
from grader.quality.linting import copied_lines
from grader.quality.parsed_module import Module

FOLDERS = ("test", "tests")
# What `ros2 pkg create` puts into every package, and the like: they call a linter and say nothing about the code.
_LINTERS = re.compile(r"\bament_(copyright|flake8|pep257|mypy|xmllint|pycodestyle|lint)\b")
_READ_CAP = 1_000_000  # bytes
_COPIED_LINES = 12  # twice what Q3 calls a copy; a message that is filled the same way takes fewer


def discover_tests(package: Path, nodes: Collection[str]) -> list[TestModule]:
    """Return the test modules below test/ and tests/ with what their text says, ordered by path. Nothing is run.

    Which of the `nodes` they test, a run shows.
    """
    files = sorted(path for folder in FOLDERS for path in (package / folder).rglob("*.py") if path.is_file())
    trees = {path: tree for path in files if (tree := _read(path)) is not None}
    helpers = _asserting_names(trees.values())
    nodes_of = (node for tree in trees.values() for node in ast.walk(tree))
    classes = {node.name: node for node in nodes_of if isinstance(node, ast.ClassDef)}
    cases = _test_cases(classes)
    found = []
    for path in files:
        if not (path.name.startswith("test_") or path.name.endswith("_test.py")):
            continue
        name = str(path.relative_to(package))
        try:
            found.append(
                _describe(name, list(_tests(trees[path], classes, cases)), ast.unparse(trees[path]), helpers, nodes)
            )
        except (KeyError, *TOO_COMPLEX):  # it has no tree, or one that cannot be written out
            why = [f"{name} cannot be read as Python"]
            found.append(TestModule(name, stub=False, tests=0, asserting=0, failures=why))
    return found


def copy_flags(package: Path, texts: Mapping[str, str | None]) -> list[Flag]:
    """Return a flag if the tests hold a copy of the package's modules, given by path: in a file, or as a string.

    Tests that compare the package with a copy of itself notice every change and show nothing.
    """
    originals = [Module(name, tree, 0) for name, text in texts.items() if text is not None and (tree := parse(text))]
    files = sorted(path for folder in FOLDERS for path in (package / folder).rglob("*") if path.is_file())
    found = {}
    for path in files:
        name = str(path.relative_to(package))
        if (tree := _read(path)) is not None:
            strings = (node.value for node in ast.walk(tree) if isinstance(node, ast.Constant))
            inside = (parse(text) for text in strings if isinstance(text, str) and text.count("\n") >= _COPIED_LINES)
            lines = [copied_lines(originals, Module(name, made, 0)) for made in (tree, *inside) if made]
            if max(lines) >= _COPIED_LINES:
                found[name] = max(lines)
    if not found:
        return []
    words = (
        f"{sum(found.values())} lines of the package stand in its tests, too: do they compare it with a copy of itself?"
    )
    return [Flag("copy of the package", words, where=", ".join(found), concerns=["student tests", "mutation"])]


def is_run(module: TestModule) -> bool:
    """Return whether a module has tests that say something about the package, so that they are run."""
    return bool(module.tests) and not module.stub


def _describe(name: str, tests: Sequence[Function], code: str, helpers: set[str], nodes: Collection[str]) -> TestModule:
    silent = [test.name for test in tests if not _asserts(test, helpers)]
    return TestModule(
        path=name,
        stub=bool(_LINTERS.search(code)) and not any(re.search(rf"\b{node}\b", code) for node in nodes),
        tests=len(tests),
        asserting=len(tests) - len(silent),
        silent=silent[:50],
    )


def _read(path: Path) -> ast.Module | None:
    return parse(path.read_bytes()) if path.stat().st_size <= _READ_CAP else None


def _tests(tree: ast.Module, classes: Mapping[str, ast.ClassDef], cases: Container[str]) -> Iterator[Function]:
    """Yield the functions that pytest would collect: those of the module, of its classes, and of their bases.

    `classes` are all that the tests write, by name, `cases` the names of those that are unittest's.
    """
    scopes: list[ast.Module | ast.ClassDef] = [tree]
    seen = set[ast.AST]()
    for scope in scopes:
        yield from filter(is_test, scope.body)
        classes_here = [node for node in scope.body if isinstance(node, ast.ClassDef)]
        found = [node for node in classes_here if node.name.startswith("Test") or node.name in cases]
        found += [classes[name] for name in map(last_name, getattr(scope, "bases", [])) if name in classes]
        scopes += [node for node in dict.fromkeys(found) if node not in seen]
        seen.update(found)


def _test_cases(classes: Mapping[str, ast.ClassDef]) -> set[str]:
    """Return the names of unittest's classes of tests: those with a base called TestCase, and those built on them."""
    below: dict[str, list[str]] = {}
    for node in classes.values():
        for base in node.bases:
            below.setdefault(last_name(base), []).append(node.name)
    return _reachable([name for name in below if name.endswith("TestCase")], below)


def _asserting_names(trees: Iterable[ast.Module]) -> set[str]:
    """Return the names of the helper functions that assert something, themselves or through another helper."""
    callers: dict[str, set[str]] = {}
    found: list[str] = []
    for function in (node for tree in trees for node in ast.walk(tree) if isinstance(node, Function)):
        if _asserts(function, ()):
            found.append(function.name)
        for name in _called_in(function):
            callers.setdefault(name, set()).add(function.name)
    return _reachable(found, callers)  # from those that assert to their callers, to theirs, and so on


def _reachable(names: list[str], edges: Mapping[str, Iterable[str]]) -> set[str]:
    """Return the names, and all to which the edges lead from them."""
    found: set[str] = set()
    while names:
        name = names.pop()
        if name not in found:
            found.add(name)
            names += edges.get(name, ())
    return found


def _asserts(function: Function, helpers: Container[str]) -> bool:
    """Return whether a function asserts anything but a constant. Whether it can fail, the run on raising code shows."""
    if any(isinstance(node, ast.Assert) and not isinstance(node.test, ast.Constant) for node in ast.walk(function)):
        return True
    return any(
        name in helpers or name.startswith("assert") or name in ("raises", "warns", "fail")
        for name in _called_in(function)
    )


def _called_in(function: Function) -> Iterator[str]:
    """Yield the last names of what a function calls."""
    return (called(node) for node in ast.walk(function) if isinstance(node, ast.Call))
