"""Choose the mutants to try and the tests to run on each. Decided by seed and coverage alone, never by the clock."""

from __future__ import annotations

import ast
import contextlib
import random
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice

from grader.mutation.source_text import Change, SourceText, header
from grader.python_ast import TOO_COMPLEX, Function
from grader.student_tests.module_results import ModuleReach

_DRAWN = 10  # times what is wanted, to choose from
_EACH_AT_LEAST = 5  # changes of a module, where the nodes themselves are very short


@dataclass(frozen=True)
class Selection:
    """The tests of one module that reach a change, in the order in which to run them."""

    module: str
    tests: tuple[str, ...]


def choose(
    changes: Sequence[Change], count: int, rng: random.Random, nodes: frozenset[str] = frozenset()
) -> list[Change]:
    """Return up to `count` changes, spread over functions and kinds, in the order in which to try them.

    No module has more of them than the `nodes` (their modules) together: many small functions must not push the nodes
    aside.
    """
    if not nodes:
        return _spread_out(changes, count, rng)
    order = _spread_out(_of_few_functions(changes, nodes, rng), _DRAWN * count, rng)
    for at_most in range(count, _EACH_AT_LEAST, -1):
        chosen = list(islice(_few_of_each(order, at_most, nodes), count))
        of_nodes = sum(change.path in nodes for change in chosen)
        others = Counter(change.path for change in chosen if change.path not in nodes)
        if max(others.values(), default=0) <= of_nodes:
            return chosen
    return list(islice(_few_of_each(order, _EACH_AT_LEAST, nodes), count))


def _of_few_functions(changes: Sequence[Change], nodes: frozenset[str], rng: random.Random) -> list[Change]:
    """Return the changes without those of most functions, where a module has more of them than the nodes together."""
    functions: dict[str, dict[str, None]] = defaultdict(dict)
    for change in changes:
        functions[change.path][change.function] = None
    most = max(_EACH_AT_LEAST, sum(len(names) for path, names in functions.items() if path in nodes))
    kept = {
        path: set(names if path in nodes or len(names) <= most else rng.sample(list(names), most))
        for path, names in functions.items()
    }
    return [change for change in changes if change.function in kept[change.path]]


def _few_of_each(changes: Iterable[Change], at_most: int, nodes: frozenset[str]) -> Iterator[Change]:
    """Yield the changes without those of a module, other than a node's, that has had `at_most` already."""
    count: Counter[str] = Counter()
    for change in changes:
        if change.path in nodes or count[change.path] < at_most:
            count[change.path] += 1
            yield change


def _spread_out(changes: Sequence[Change], count: int, rng: random.Random) -> list[Change]:
    """Return up to `count` changes: one of each function, then a second one of each, and so on."""
    by_function: dict[tuple[str, str], list[Change]] = defaultdict(list)
    for change in changes:
        by_function[change.path, change.function].append(change)
    functions = sorted(by_function)
    rng.shuffle(functions)
    for function in functions:
        rng.shuffle(by_function[function])
    kinds: Counter[str] = Counter()
    chosen: list[Change] = []
    while functions and len(chosen) < count:
        for function in list(functions):
            left = by_function[function]
            change = min(left, key=lambda c: kinds[c.operator])
            left.remove(change)
            # Two mutants of one kind in one line would ask the same question twice.
            by_function[function] = [c for c in left if c.line != change.line or c.operator != change.operator]
            if not by_function[function]:
                functions.remove(function)
            kinds[change.operator] += 1
            chosen.append(change)
            if len(chosen) == count:
                break
    return chosen


class Selector:
    """Knows which tests reach which change, from the coverage of each test."""

    def __init__(self, sources: Mapping[str, SourceText], reach: Sequence[ModuleReach]) -> None:
        self._uses = _uses(sources.values())
        self._reach = reach
        self._breadth = {r.module: _breadth(r) for r in reach}

    def tests(self, change: Change, without: Iterable[str] = (), whole: Iterable[str] = ()) -> list[Selection]:
        """Return the tests that reach a change, module by module. The narrowest come first: they are the quickest.

        Tests in `without` are left out. In the modules `whole`, and where tests share a fixture, all tests run in the
        module's own order as soon as one of them reaches the change.
        """
        found = []
        for reach in self._reach:
            names = self._of_module(change, reach) - set(without)
            if not names:
                continue
            breadth = self._breadth[reach.module]
            if reach.interdependent or reach.module in whole:
                order = [name for name in reach.seconds if name not in set(without)]
            else:
                place = {name: number for number, name in enumerate(reach.seconds)}
                order = sorted(names, key=lambda name: (breadth[name], place[name]))
            found.append((breadth[min(names, key=lambda name: breadth[name])], Selection(reach.module, tuple(order))))
        return [selection for _, selection in sorted(found, key=lambda pair: (pair[0], pair[1].module))]

    def _of_module(self, change: Change, reach: ModuleReach) -> set[str]:
        first, last = change.lines
        direct = _hits(reach, change.path, range(first, last + 1))
        if direct - {""}:
            return (direct & set(reach.seconds)) or (set(reach.seconds) if reach.interdependent else set())
        if not direct:
            return set()
        if reach.interdependent:
            return set(reach.seconds)
        # It runs on import: what depends on it is the code that uses the names it binds.
        users: set[str] = set()
        for name in change.names:
            for path, first, last in self._uses.get(name, ()):
                users |= _hits(reach, path, range(first, last + 1))
        users &= set(reach.seconds)
        if users:
            return users
        lines = reach.lines.get(change.path, {})
        return {test for tests in lines.values() for test in tests} & set(reach.seconds)


def _hits(reach: ModuleReach, path: str, lines: Iterable[int]) -> set[str]:
    by_line = reach.lines.get(path, {})
    return {test for line in lines for test in by_line.get(line, ())}


def _breadth(reach: ModuleReach) -> dict[str, int]:
    """Return for each test how many lines of the package it reaches."""
    count: Counter[str] = Counter()
    for by_line in reach.lines.values():
        for tests in by_line.values():
            count.update(tests)
    return {name: count[name] for name in reach.seconds}


def _uses(sources: Iterable[SourceText]) -> dict[str, list[tuple[str, int, int]]]:
    """Return for each name the statements inside functions that use it: (path, first line, last line)."""
    found: dict[str, list[tuple[str, int, int]]] = defaultdict(list)
    for source in sources:
        with contextlib.suppress(*TOO_COMPLEX):  # such a source has no mutants either
            for name, first, last in list(_uses_in(source)):
                found[name].append((source.path, first, last))
    return found


def _uses_in(source: SourceText) -> Iterator[tuple[str, int, int]]:
    for function in (node for node in ast.walk(source.tree) if isinstance(node, Function)):
        yield function.name, function.body[0].lineno, function.end_lineno or function.lineno
        for statement in (node for top in function.body for node in ast.walk(top) if isinstance(node, ast.stmt)):
            for name in _names_in(statement):
                yield (name, *header(statement))


def _names_in(node: ast.AST) -> Iterator[str]:
    """Yield the names that a statement uses, without those of the statements in it."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.stmt):
            continue
        if isinstance(child, ast.Name):
            yield child.id
        elif isinstance(child, ast.Attribute):
            yield child.attr
        yield from _names_in(child)
