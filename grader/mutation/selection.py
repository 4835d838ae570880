"""Choose the mutants to try and the tests to run on each. Decided by source and coverage, not by dice or the clock."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from grader.mutation.source_text import Change
from grader.student_tests.module_results import ModuleReach

_CONSIDERED = 10  # times as many changes as are to be tried, before long modules are cut to the length of others
# Its multiples, without their whole parts, cover the interval from 0 to 1 evenly, however many there are.
_GOLDEN = (5**0.5 - 1) / 2


@dataclass(frozen=True)
class Selection:
    """The tests of one module that reach a change, in the order in which to run them."""

    module: str
    tests: tuple[str, ...]


def choose(changes: Sequence[Change], count: int, is_reached: Callable[[Change], bool]) -> list[Change]:
    """Return changes, `count` of them reached by tests if there are so many, in the order in which to try them.

    Those that no test reaches are among them in proportion. Where there are many, no module has more than an even share
    of those considered: a thousand small functions must not push the nodes aside.
    """
    by_path: dict[str, list[Change]] = defaultdict(list)
    for change in changes:
        by_path[change.path].append(change)
    most = 0
    while sum(min(len(own), most) for own in by_path.values()) < min(_CONSIDERED * count, len(changes)):
        most += 1
    order = evenly([own[place] for own in by_path.values() for place in sorted(_spread(len(own))[:most])])
    places = [place for place, change in enumerate(order, 1) if is_reached(change)]
    return order[: places[count - 1] if len(places) >= count else len(order)]


def evenly(changes: Sequence[Change]) -> list[Change]:
    """Return the changes in an order of which any first part is spread evenly over files, functions and lines.

    It depends on nothing but the changes: drawn by a seed, forty mutants moved a package by 0.9 of 6 points.
    """
    return [changes[place] for place in _spread(len(changes))]


def _spread(count: int) -> list[int]:
    """Return the numbers below `count` in an order of which any first part is spread evenly over them."""
    return sorted(range(count), key=lambda place: place * _GOLDEN % 1)


class Selector:
    """Knows which tests reach which change, from the coverage of each test."""

    def __init__(self, reach: Sequence[ModuleReach]) -> None:
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
        return set(reach.seconds)  # it runs on import, or in a fixture that tests share


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
