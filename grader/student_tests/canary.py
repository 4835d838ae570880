"""Canaries: what must come out a certain way if nobody tampers with pytest or with coverage's data. Text only.

Whatever runs in one process with the submission can be forged by it, so its reports are held against runs whose
result is known beforehand: a test that must fail, the submission's own tests made to fail, functions made to raise.
"""

from __future__ import annotations

import ast
import random
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import PurePosixPath

from grader.python_ast import Function, parse
from grader.student_tests.warm_worker import Ran, Test

_WORDS = (
    "keeps", "turns", "waits", "slows", "stops", "starts", "follows", "measures", "resets", "limits", "rounds",
    "scales", "steers", "brakes", "answers", "distance", "speed", "heading", "battery", "scan", "goal", "pose", "rate",
    "angle", "margin", "status", "odometry", "clock", "timer", "target", "beam",
)  # fmt: skip
_PROBED_TESTS = 12
_SABOTAGED_TESTS = 3


@dataclass(frozen=True)
class Canary:
    """A module with one test that must pass and one that must fail, both of random name."""

    path: str
    text: str
    passes: str
    fails: str


def canary(module: str, chance: random.Random) -> Canary:
    """Return a canary to be run beside a test module, in the same folder."""

    def name() -> str:
        return "_".join(chance.sample(_WORDS, 3)) + f"_{chance.randrange(10**6)}"

    number = chance.randrange(2, 10**6)
    path = str(PurePosixPath(module).with_name(f"test_{name()}.py"))
    passes, fails = f"test_{name()}", f"test_{name()}"
    text = (
        f"def {passes}():\n    assert {number} + 1 == {number + 1}\n\n\n"
        f"def {fails}():\n    assert {number} + 1 == {number - 1}\n"
    )
    return Canary(path, text, f"{path}::{passes}", f"{path}::{fails}")


def judge_canary(ran: Ran, canary: Canary) -> str:
    """Return what is wrong with the reports of a run, "" if nothing is."""
    outcomes = {test.id: test.outcome for test in ran.tests}
    others = [test for name, test in sorted((t.id, t) for t in ran.tests) if name not in (canary.passes, canary.fails)]
    if outcomes.get(canary.fails) == "passed":
        return "a test of the grader's that must fail was reported as passed"
    if ran.ended and not ran.late and canary.fails not in outcomes and any(t.outcome == "passed" for t in others):
        return "a test of the grader's that must fail was not reported at all"
    return ""


def sabotage(text: str, tests: Sequence[Test], chance: random.Random) -> tuple[str, list[str]]:
    """Return the module with the bodies of a few of its tests made to fail, and the ids of those tests.

    Where that can be, a test fails at its end: one that fails before, and is told as passed by somebody who knows its
    words, is so again.
    """
    lines = _lines(text)
    passed = [test.id for test in tests if test.outcome == "passed" and not test.expected]
    chosen: list[str] = []
    for function in sorted(_test_functions(text), key=lambda f: f.lineno, reverse=True):
        ids = [name for name in passed if _function_of(name) == function.name]
        if ids:
            chosen.append(ids[0])
    picked = set(chance.sample(chosen, min(_SABOTAGED_TESTS, len(chosen))))
    for function in sorted(_test_functions(text), key=lambda f: f.lineno, reverse=True):
        if any(_function_of(name) == function.name for name in picked):
            # Like a failure of its own: one that could be told from others would be let through by who forges those.
            wrong = f"assert {chance.randrange(2, 1000)} == {chance.randrange(1000, 9999)}"
            if not _raise_last(lines, function, f"raise AssertionError({wrong!r})"):
                _replace_body(lines, function, f"raise AssertionError({wrong!r})")
    return "".join(lines), [name for name in passed if name in picked]


def judge_sabotage(ran: Ran, names: Sequence[str]) -> str:
    """Return which tests passed although they could not, "" if none did."""
    passed = [test.id for test in ran.tests if test.id in names and test.outcome == "passed"]
    if not passed:
        return ""
    short = ", ".join(name.rpartition("::")[2] for name in passed)
    return f"{short} was reported as passed when nothing but `raise AssertionError` stood in it"


@dataclass(frozen=True)
class Probe:
    """Modules in which functions do nothing but raise, and the lines that nobody can reach any more."""

    texts: Mapping[str, str]
    unreachable: Mapping[str, frozenset[int]]


def probes(
    sources: Mapping[str, str], reach: Mapping[str, Mapping[int, frozenset[str]]], chance: random.Random
) -> list[Probe]:
    """Return the modules with every function that was reached made to raise as soon as it is called.

    They come in two halves, drawn by `chance`: who looks whether a function raises before he claims a line meets a
    probe in which that one does not. Functions said to be called while importing come in a probe of their own: if that
    is true, no test runs in it.
    """
    halves: dict[tuple[str, str, int], bool] = {}

    def half(path: str, function: Function) -> bool:
        return halves.setdefault((path, function.name, function.lineno), chance.random() < 0.5)

    found = [
        _probe(sources, reach, False, half),
        _probe(sources, reach, False, lambda path, function: not half(path, function)),
        _probe(sources, reach, True, lambda _path, _function: True),
    ]
    return [probe for probe in found if probe.texts]


def _probe(
    sources: Mapping[str, str],
    reach: Mapping[str, Mapping[int, frozenset[str]]],
    importing: bool,
    wanted: Callable[[str, Function], bool],
) -> Probe:
    texts, unreachable = {}, {}
    for path, text in sources.items():
        by_line = reach.get(path, {})
        lines = _lines(text)
        dead: set[int] = set()
        for function in sorted(_functions(text), key=lambda f: f.lineno, reverse=True):
            first, last = _body_lines(function)
            hits = [by_line[n] for n in range(first, last + 1) if n in by_line]
            if not hits or any("" in tests for tests in hits) != importing or not wanted(path, function):
                continue
            if last > function.lineno:
                if _raise_first(lines, function):
                    dead = {line + 1 for line in dead} | set(range(first + 1, last + 2))
                elif last > first:
                    _replace_body(lines, function, "raise RuntimeError('not reached')")
                    dead |= set(range(first + 1, last + 1))
        if dead:
            texts[path], unreachable[path] = "".join(lines), frozenset(dead)
    return Probe(texts, unreachable)


def probed_tests(tests: Sequence[Test], chance: random.Random) -> list[str]:
    """Return the tests to run for a probe: the first, the last and some between, in their order."""
    names = [test.id for test in tests if test.outcome == "passed"]
    if len(names) <= _PROBED_TESTS:
        return names
    kept = {names[0], names[-1], *chance.sample(names[1:-1], _PROBED_TESTS - 2)}
    return [name for name in names if name in kept]


def judge_probe(ran: Ran, probe: Probe) -> str:
    """Return which lines were said to be reached although they could not, "" if none were."""
    for path, dead in probe.unreachable.items():
        claimed = sorted(dead & set(ran.reach.get(path, {})))
        if claimed:
            return f"lines of {path} were reported as reached that nothing could reach, line {claimed[0]} among them"
    return ""


def _lines(text: str) -> list[str]:
    """Return the lines as Python counts them."""
    return [f"{line}\n" for line in re.split(r"\r\n|\r|\n", text)]


def _functions(text: str) -> list[Function]:
    """Return the outermost functions and methods of a module."""
    found: list[Function] = []
    waiting: list[ast.AST] = list((parse(text) or ast.Module([], [])).body)
    for node in waiting:
        if isinstance(node, Function):
            found.append(node)
        elif isinstance(node, ast.ClassDef | ast.If | ast.Try | ast.With):
            waiting += node.body
    return found


def _test_functions(text: str) -> list[Function]:
    return [function for function in _functions(text) if function.name.startswith("test")]


def _function_of(name: str) -> str:
    """Return "test_it" for "test/test_x.py::TestIt::test_it[a-b]"."""
    return name.partition("[")[0].rpartition("::")[2]


def _body(function: Function) -> list[ast.stmt]:
    first = function.body[0]
    is_docstring = isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant)
    return function.body[1:] if is_docstring and len(function.body) > 1 else function.body


def _body_lines(function: Function) -> tuple[int, int]:
    first = _body(function)[0]
    decorators = [decorator.lineno for decorator in getattr(first, "decorator_list", ())]
    return min([first.lineno, *decorators]), function.end_lineno or function.lineno


def _raise_first(lines: list[str], function: Function) -> bool:
    """Put a line that raises before a function's body, which stays: who reads which lines there are shall see them all.

    Return whether that was possible: the body may stand on the line of the `def`, or behind a docstring and `;`.
    """
    first, _ = _body_lines(function)
    line = lines[first - 1]
    indent = line[: len(line) - len(line.lstrip())]
    before = line.encode()[: _body(function)[0].col_offset].decode()
    if before.strip() or lines[first - 2].rstrip().endswith("\\"):
        return False
    # No statement of which a reader of the source, or Python itself, could tell that it ends the function.
    lines.insert(first - 1, f"{indent}(_ for _ in ()).throw(RuntimeError('not reached'))\n")
    return True


def _raise_last(lines: list[str], function: Function, new: str) -> bool:
    """Put a statement behind a function's body. Return whether it can be told to be the last that is done there."""
    first = function.body[0]
    line = lines[first.lineno - 1]
    indent = line[: len(line) - len(line.lstrip())]
    leaves = (ast.Return, ast.Yield, ast.YieldFrom)
    if first.lineno == function.lineno or len(indent.encode()) != first.col_offset:
        return False
    if any(isinstance(node, leaves) for node in ast.walk(function)):
        return False
    last = function.end_lineno or function.lineno
    lines.insert(last, f"{indent}{new}\n")
    return True


def _replace_body(lines: list[str], function: Function, new: str) -> None:
    """Put one statement in the place of a function's body, all other lines where they were."""
    body = _body(function)
    first, last = body[0].lineno, function.end_lineno or body[-1].lineno
    head = lines[first - 1].encode()[: body[0].col_offset].decode()
    lines[first - 1 : last] = [f"{head}{new}\n", *["\n"] * (last - first)]
