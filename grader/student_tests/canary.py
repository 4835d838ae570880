"""Canaries: runs whose result is known beforehand, to check that pytest's reports and coverage's data can be believed.

Code that runs in one process with the submission can be forged by it. So its reports are checked against a test that
must fail, the submission's own tests made to fail, and functions made to raise. Text only; nothing is run here.
"""

from __future__ import annotations

import random
from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass
from functools import partial
from pathlib import PurePosixPath

from grader.python_ast import Function
from grader.student_tests.function_edits import body_lines, fail_when_run, functions_from_the_end, make_raise
from grader.student_tests.worker_report import ModuleRun, TestResult

_WORDS = (
    "keeps", "turns", "waits", "slows", "stops", "starts", "follows", "measures", "resets", "limits", "rounds",
    "scales", "steers", "brakes", "answers", "distance", "speed", "heading", "battery", "scan", "goal", "pose", "rate",
    "angle", "margin", "status", "odometry", "clock", "timer", "target", "beam",
)  # fmt: skip
_PROBED_TESTS = 12
_SABOTAGED_TESTS = 3

Reach = Mapping[str, Mapping[int, frozenset[str]]]
"""The tests that reached each line of each module."""
Place = tuple[str, int, str]
"""Where a function is: module, line, name."""


@dataclass(frozen=True)
class Canary:
    """A module with one test that must pass and one that must fail, both with random names."""

    path: str
    text: str
    passes: str
    fails: str


def make_canary(module: str, rng: random.Random) -> Canary:
    """Return a canary to run beside a test module, in the same folder."""

    def name() -> str:
        return "_".join(rng.sample(_WORDS, 3)) + f"_{rng.randrange(10**6)}"

    number = rng.randrange(2, 10**6)
    path = str(PurePosixPath(module).with_name(f"test_{name()}.py"))
    passes, fails = f"test_{name()}", f"test_{name()}"
    text = (
        f"def {passes}():\n    assert {number} + 1 == {number + 1}\n\n\n"
        f"def {fails}():\n    assert {number} + 1 == {number - 1}\n"
    )
    return Canary(path, text, f"{path}::{passes}", f"{path}::{fails}")


def judge_canary(ran: ModuleRun, canary: Canary) -> str:
    """Return what is wrong with the reports of a run, "" if nothing is."""
    outcomes = {test.id: test.outcome for test in ran.tests}
    if outcomes.get(canary.fails) == "passed":
        return "a test of the grader's that must fail was reported as passed"
    others_passed = any(
        outcome == "passed" for name, outcome in outcomes.items() if name not in (canary.passes, canary.fails)
    )
    if ran.finished and not ran.timed_out and canary.fails not in outcomes and others_passed:
        return "a test of the grader's that must fail was not reported at all"
    return ""


def sabotage(text: str, tests: Sequence[TestResult], rng: random.Random) -> tuple[str, list[str]]:
    """Return the module with a few of its tests made to fail, and the ids of those tests.

    Where possible a test fails at its end: one that failed before then fails in the same words, and whoever forges
    reports by those words forges this one too.
    """
    functions = [function for function in functions_from_the_end(text) if function.name.startswith("test")]
    passed = [test.id for test in tests if test.outcome == "passed" and not test.xfail]
    candidates = [ids[0] for f in functions if (ids := [name for name in passed if _function_of(name) == f.name])]
    chosen = set(rng.sample(candidates, min(_SABOTAGED_TESTS, len(candidates))))
    sabotaged = [f for f in functions if any(_function_of(name) == f.name for name in chosen)]
    # Worded like a failure of the test's own: a forger must not be able to tell it from those.
    errors = [f"assert {rng.randrange(2, 1000)} == {rng.randrange(1000, 9999)}" for _ in sabotaged]
    changed = fail_when_run(text, zip(sabotaged, errors, strict=True))
    return changed, [name for name in passed if name in chosen]


def judge_sabotage(ran: ModuleRun, names: Sequence[str]) -> str:
    """Return which sabotaged tests were reported as passed, or that the process ended instead; "" if all failed."""
    short = ", ".join(name.rpartition("::")[2] for name in names)
    if is_silent(ran, names):
        return f"the process ended when the grader made {short} fail, and never else"
    passed = [test.id for test in ran.tests if test.id in names and test.outcome == "passed"]
    if not passed:
        return ""
    short = ", ".join(name.rpartition("::")[2] for name in passed)
    return f"{short} was reported as passed although the grader made it raise AssertionError"


def is_silent(ran: ModuleRun, names: Sequence[str]) -> bool:
    """Return whether a run ended by itself before it had reported any of these tests."""
    return not (ran.finished or ran.timed_out or any(test.id in names for test in ran.tests))


@dataclass(frozen=True)
class Probe:
    """Modules in which functions raise as soon as they are called, and the lines that became unreachable.

    `tests` are those that call such a function.
    """

    texts: Mapping[str, str]
    unreachable: Mapping[str, frozenset[int]]
    tests: frozenset[str]


def probes(sources: Mapping[str, str], reach: Reach, rng: random.Random) -> list[Probe]:
    """Return the modules with every function that was reached made to raise as soon as it is called.

    They come in two halves, drawn by `rng`: a forger that claims a line only if some function does not raise meets a
    probe in which that function does not. Functions reported as called on import come in a probe of their own: if the
    report is true, no test runs in it.
    """
    in_tests, on_import = functions_reached(sources, reach)
    half = {function for function in sorted(in_tests) if rng.random() < 0.5}
    found = [_probe(sources, functions, reach) for functions in (half, in_tests - half, on_import)]
    return [probe for probe in found if probe.texts]


def functions_reached(sources: Mapping[str, str], reach: Reach) -> tuple[set[Place], set[Place]]:
    """Return the functions that were reached in tests only, and those that were reached on import."""
    in_tests, on_import = set[Place](), set[Place]()
    for path, text in sources.items():
        by_line = reach.get(path, {})
        for function in functions_from_the_end(text) if by_line else ():
            if hits := _hits(function, by_line):
                (on_import if any("" in tests for tests in hits) else in_tests).add(_place(path, function))
    return in_tests, on_import


def _hits(function: Function, by_line: Mapping[int, frozenset[str]]) -> list[frozenset[str]]:
    """Return the tests that reached each line of a function's body."""
    first, last = body_lines(function)
    return [by_line[line] for line in range(first, last + 1) if line in by_line]


def _place(path: str, function: Function) -> Place:
    return path, function.lineno, function.name


def _probe(sources: Mapping[str, str], functions: Set[Place], reach: Reach) -> Probe:
    def is_probed(path: str, function: Function) -> bool:
        return _place(path, function) in functions

    texts, unreachable, tests = {}, {}, frozenset[str]()
    for path, text in sources.items():
        changed, dead, made = make_raise(text, partial(is_probed, path))
        if dead:
            texts[path], unreachable[path] = changed, frozenset(dead)
            tests = tests.union(*(hit for function in made for hit in _hits(function, reach.get(path, {}))))
    return Probe(texts, unreachable, tests - {""})


def probed_tests(tests: Sequence[TestResult], rng: random.Random) -> list[str]:
    """Return the tests to run on a probe: the first, the last and some between, in their order."""
    names = [test.id for test in tests if test.outcome == "passed"]
    if len(names) <= _PROBED_TESTS:
        return names
    kept = {names[0], names[-1], *rng.sample(names[1:-1], _PROBED_TESTS - 2)}
    return [name for name in names if name in kept]


def is_idle(ran: Sequence[tuple[Probe, ModuleRun]], tests: Sequence[str]) -> bool:
    """Return whether every one of these tests passed on each probe in which a function raises that it calls."""
    met = [(run, name) for probe, run in ran for name in tests if name in probe.tests & {*run.collected}]
    passed = all(any((test.id, test.outcome) == (name, "passed") for test in run.tests) for run, name in met)
    return passed and bool(met) and {name for _, name in met} == set(tests)


def judge_probe(ran: ModuleRun, probe: Probe) -> str:
    """Return which lines were reported as reached although they could not be, "" if none were."""
    for path, dead in probe.unreachable.items():
        claimed = sorted(dead & set(ran.reach.get(path, {})))
        if claimed:
            return f"lines of {path} were reported as reached that nothing could reach, line {claimed[0]} among them"
    return ""


def _function_of(name: str) -> str:
    """Return "test_x" for "test/test_a.py::TestA::test_x[1-2]"."""
    return name.partition("[")[0].rpartition("::")[2]
