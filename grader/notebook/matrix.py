"""Show which of a module's mutants are noticed by which tests, and take one for a drive: `mutant_matrix`, `mutant`.

It is for plain functions and runs in the notebook's kernel. What a grading counts is decided by grader.mutation.
"""

from __future__ import annotations

import inspect
import itertools
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from textwrap import fill
from types import ModuleType
from typing import Any

from grader.mutation.operators import mutants
from grader.mutation.source_text import Change, SourceText, parse
from grader.notebook import last_hint
from grader.notebook.bench import Missing
from grader.notebook.tables import HangError, limited
from grader.notebook.workspace import course
from grader.words import say

LONGEST_S = 2.0  # wall time for all tests on one mutant, which may loop for ever; they take milliseconds


@dataclass(frozen=True)
class Matrix:
    """Which tests notice which mutants: `noticed[mutant][test]`.

    `failing` are the tests that fail on the code as it is, each with the first call that does and what it raised.
    """

    mutants: tuple[str, ...]
    tests: tuple[str, ...]
    noticed: tuple[tuple[bool, ...], ...]
    failing: Mapping[str, str]


def mutant_matrix(module: str, tests: str, function: str = "") -> None:
    """Draw which mutants of a module, or of one of its functions, are noticed by which tests.

    A mutant is a copy of the module with one small mistake in it. Tests that use fixtures are left out.

    Args:
        module: the module's file, such as "ros2_robot_controller/utils/motion.py".
        tests: the file of its tests.
        function: the name of the only function to look at, "" for the whole module.
    """
    try:
        found = matrix(Path(module), Path(tests), function)
    except Exception as error:  # of the student's files
        print(say("not yet: {name}: {error}", name=type(error).__name__, error=error))
        last_hint.tried(right=False)
        return
    last_hint.tried(bool(found.tests) and not found.failing)
    for name, why in found.failing.items():
        print(say("not yet: {name} fails on the code as it is, so it is left out: {why}", name=name, why=why))
    if found.tests and found.mutants:
        _draw(found)
    elif not found.tests and not found.failing:
        print(say("not yet: {tests} holds no test", tests=tests))
    elif not found.failing:
        print(say("not yet: {module} has no function {function}", module=module, function=function))


def mutant(module: str, row: int, function: str = "") -> Any:
    """Return a module with one mistake in it, that of a row of its matrix, and say which; the first row is 1.

    Where there is none, say why; each use of it then fails with the same words.

    Args:
        module: the module's file, such as "ros2_robot_controller/utils/motion.py".
        row: the row, in the matrix of the same module and function.
        function: as in `mutant_matrix`.
    """
    path = Path(module)
    try:
        source, changes = _mutants(path, function)
        if not 0 < row <= len(changes):
            raise ValueError(say("there are {count} rows, and no row {row}", count=len(changes), row=row))
        with _in_place_of(_dotted(path)) as broken:
            exec(compile(source.apply(changes[row - 1]), module, "exec"), broken.__dict__)
    except Exception as error:  # of the student's file
        why = f"{type(error).__name__}: {error}"
        print(say("not yet: {why}", why=why))
        return Missing(why)
    print(_row(changes[row - 1]))
    return broken


def matrix(module: Path, tests: Path, function: str = "") -> Matrix:
    """Return which mutants are noticed by which tests.

    Raises:
        Exception: the module or the file of its tests cannot be read, parsed or executed.
    """
    source, changes = _mutants(module, function)
    name, checks = _dotted(module), tests.read_text(encoding="utf-8")
    failures = _failures(name, source.text, checks)
    names = [test for test, why in failures.items() if not why]
    return Matrix(
        mutants=tuple(_row(change) for change in changes),
        tests=tuple(test.removeprefix("test_") for test in names),
        noticed=tuple(_noticed(name, source.apply(change), checks, names) for change in changes),
        failing={test: why for test, why in failures.items() if why},
    )


def _mutants(module: Path, function: str) -> tuple[SourceText, list[Change]]:
    text = module.read_text(encoding="utf-8")
    source = parse(str(module), text)
    if source is None:
        compile(text, str(module), "exec")  # raises the error that names the line
        raise ValueError(say("{module} cannot be parsed", module=module))
    changes = mutants(source, course())
    return source, [change for change in changes if function in ("", change.function.rpartition(".")[2])]


def _row(change: Change) -> str:
    return f"{change.line}: {change.words.replace('`', '')}"


def _dotted(module: Path) -> str:
    """Return the name by which tests import a module."""
    parts = module.with_suffix("").parts
    package = course().package
    return ".".join(parts[len(parts) - 1 - parts[::-1].index(package) :]) if package in parts else module.stem


def _noticed(name: str, broken: str, checks: str, names: Sequence[str]) -> tuple[bool, ...]:
    try:
        with limited(LONGEST_S):
            failures = _failures(name, broken, checks)
    except (Exception, HangError):  # what cannot even be imported, or never ends, is noticed by whoever tries
        return (True,) * len(names)
    return tuple(bool(failures[test]) for test in names)


def _failures(name: str, text: str, checks: str) -> dict[str, str]:
    """Return for each test of a file what fails, "" if nothing does, while a module of this name has this text."""
    file = ModuleType("tests_of_a_mutant")
    with _in_place_of(name) as under_test:
        exec(compile(text, name, "exec"), under_test.__dict__)
        exec(compile(checks, file.__name__, "exec"), file.__dict__)
        tests = {key: value for key, value in vars(file).items() if key.startswith("test_") and callable(value)}
        return {key: _failure(key, calls) for key, value in tests.items() if (calls := list(_calls(value)))}


@contextmanager
def _in_place_of(name: str) -> Iterator[ModuleType]:
    """Yield an empty module that is imported by this name until the block ends."""
    before = {name: sys.modules[name]} if name in sys.modules else {}
    sys.modules[name] = empty = ModuleType(name)
    try:
        yield empty
    finally:
        del sys.modules[name]
        sys.modules.update(before)


def _calls(test: Callable[..., object]) -> Iterator[partial[object]]:
    """Yield the test with each combination of its parametrized arguments; nothing if it needs fixtures."""
    marks = [mark.args for mark in getattr(test, "pytestmark", []) if mark.name == "parametrize"]
    for chosen in itertools.product(*(values for _, values, *_ in marks)):
        arguments: dict[str, Any] = {}
        for (names, *_), values in zip(marks, chosen, strict=True):
            split = [name.strip() for name in names.split(",")] if isinstance(names, str) else list(names)
            arguments |= dict(zip(split, values if len(split) > 1 else (values,), strict=True))
        if set(inspect.signature(test).parameters) == set(arguments):
            yield partial(test, **arguments)


def _failure(name: str, calls: Sequence[partial[object]]) -> str:
    """Return the first call that fails and what it raised, "" if none does."""
    import pytest

    for call in calls:
        try:
            call()
        except (Exception, pytest.fail.Exception) as error:  # pytest.fail is no Exception
            given = ", ".join(f"{key}={value!r}" for key, value in call.keywords.items())
            return f"{name}({given}): {type(error).__name__}{f': {error}' if str(error) else ''}"
    return ""


def _draw(found: Matrix) -> None:
    import matplotlib.pyplot as plt
    import numpy as np
    from matplotlib.colors import ListedColormap

    rows, columns = len(found.mutants), len(found.tests)
    seen = np.array(found.noticed)
    _, axes = plt.subplots(figsize=(9, 1.4 + 0.24 * rows), layout="constrained")
    axes.pcolormesh(seen[::-1], cmap=ListedColormap(["0.9", "#3a9d6a"]), vmin=0, vmax=1, edgecolors="w", lw=2)
    axes.set_yticks(np.arange(rows) + 0.5, found.mutants[::-1], fontsize=8)
    width = max(8, 42 // columns)  # characters that fit below a column
    names = [fill(name.replace("_", " "), width, break_long_words=False) for name in found.tests]
    axes.set_xticks(np.arange(columns) + 0.5, names, fontsize=8)
    axes.set(
        ylabel=say("line and mistake"),
        title=say("{n} of {rows} mutants noticed (green)", n=seen.any(axis=1).sum(), rows=rows),
    )
