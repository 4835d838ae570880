"""Sabotage and probes hit the right lines, and what a probe makes unreachable still looks like code."""

from __future__ import annotations

import ast
import random
from unittest.mock import patch

import pytest
from submissions import toy

from grader.student_tests import canary
from grader.student_tests.worker_report import TestResult

TESTS = [TestResult("test/test_it.py::test_it", "passed")]


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_sabotage_hits_the_test_with_any_line_ending(end: str):
    text = end.join(["import os", "", "def test_it():", "    assert os", ""])
    changed, names = canary.sabotage(text, TESTS, random.Random(1))
    assert names == [TESTS[0].id]
    [_, function] = ast.parse(changed).body
    assert isinstance(function, ast.FunctionDef)
    assert [type(statement) for statement in function.body] == [ast.Assert, ast.Raise]


def test_a_stray_carriage_return_does_not_move_the_sabotage():
    changed, _ = canary.sabotage("# one\r# two\n\ndef test_it():\n    assert 1 == 1\n", TESTS, random.Random(1))
    [function] = ast.parse(changed).body
    assert "raise AssertionError" in ast.unparse(function)


def everything(text: str) -> dict[int, frozenset[str]]:
    return {line: frozenset({TESTS[0].id}) for line in range(1, text.count("\n") + 1)}


def test_a_probe_keeps_the_lines_that_become_unreachable():
    """A forger that claims every line found in the source claims these too."""
    path = "ros2_robot_controller/robot_controller.py"
    left = []
    for probe in canary.probes({path: toy.CONTROLLER}, {path: everything(toy.CONTROLLER)}, random.Random(1)):
        lines = probe.texts[path].splitlines()
        left += [lines[number - 1].strip() for number in sorted(probe.unreachable[path])]
    assert "return max(distance, 0.0)" in left
    assert "if distance < 0.5:" in left
    assert not any("throw" in line or line.startswith(("def ", '"""')) for line in left)


@pytest.mark.parametrize(
    ("text", "dead"),
    [
        ("def f(): return 1\n", set()),
        ("def f():\n    return 1\n", {3}),
        ("def f():\n    '''Say.'''\n    global x\n    x = 1\n", {4, 5}),
        ("def f():\n    @g\n    def h():\n        pass\n    return h\n", {3, 4, 5, 6}),
        ("def f():\n    '''Say.'''; x = 1\n    return x\n", {3}),
        ("def f():\n    return 1\n\n\ndef g():\n    return 2\n", {3, 8}),
    ],
)
def test_a_probed_function_raises_before_anything_else(text: str, dead: set[int]):
    with patch.object(random.Random, "random", return_value=0.0):  # all in one half
        found = canary.probes({"a.py": text}, {"a.py": everything(text)}, random.Random(1))
    assert [set(probe.unreachable["a.py"]) for probe in found] == ([dead] if dead else [])
    for probe in found:
        space: dict[str, object] = {"g": lambda inner: inner}
        exec(probe.texts["a.py"], space)
        with pytest.raises(RuntimeError):
            space["f"]()  # type: ignore[operator]


def test_each_function_raises_in_one_half_and_not_in_the_other():
    """A forger that claims lines only if some function does not raise meets a probe in which it does not."""
    text = "".join(f"def f{n}():\n    return {n}\n\n\n" for n in range(20))
    one, other = canary.probes({"a.py": text}, {"a.py": everything(text)}, random.Random(1))
    raising = [
        {f.name for f in ast.parse(probe.texts["a.py"]).body if len(f.body) == 2}  # type: ignore[attr-defined]
        for probe in (one, other)
    ]
    assert raising[0] | raising[1] == {f"f{n}" for n in range(20)}
    assert not raising[0] & raising[1]
    assert all(raising)


@pytest.mark.parametrize(
    ("body", "kept"),
    [
        ("    assert f() == 7.0\n", True),
        ("    with g():\n        assert f() == 7.0\n", True),
        ("    if g():\n        return\n    assert f() == 7.0\n", False),
        ("    yield\n    assert f() == 7.0\n", False),
    ],
)
def test_a_sabotaged_test_that_failed_before_fails_in_the_same_way(body: str, kept: bool):
    """A forger that recognizes its own failures by their words then forges one of a test that cannot pass."""
    changed, names = canary.sabotage(f"def test_it():\n{body}", TESTS, random.Random(1))
    assert names == [TESTS[0].id]
    assert ("== 7.0" in changed) is kept
    [function] = ast.parse(changed).body
    assert isinstance(function, ast.FunctionDef)
    assert isinstance(function.body[-1], ast.Raise)
