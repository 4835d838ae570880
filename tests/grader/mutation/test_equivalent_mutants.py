"""Equivalent mutants keep the behaviour; nearly all mutants change it."""

from __future__ import annotations

from typing import Any

import pytest
from helpers.course import COURSE
from submissions import toy
from submissions.toy import source

from grader.mutation.equivalent_mutants import equivalent_mutants
from grader.mutation.operators import mutants
from grader.mutation.source_text import Change


def behaviour(text: str) -> list[object]:
    """Return what the functions of the toy package give for many arguments."""
    space: dict[str, Any] = {}
    exec(compile(text, "toy", "exec"), space)
    found: list[object] = []
    numbers = [-2.0, -0.6, -0.5, -0.1, 0.0, 0.1, 0.25, 0.5, 0.6, 1.0, 3.0, float("inf")]
    if "percent" in space:
        found += [space["percent"](x) for x in numbers]
        found += [space["never_called"](x, y) for x in numbers for y in numbers]
    if "RobotController" in space:
        for speed in numbers:
            for distance in numbers:
                robot = space["RobotController"]()
                found.append((robot.set_speed(speed), robot.on_scan(distance), robot.speed, robot.published))
        found += [space["stop_distance"](x) for x in numbers]
    return [repr(item) for item in found]


@pytest.mark.parametrize("text", [toy.CONTROLLER, toy.PROCESSOR])
def test_an_equivalent_mutant_changes_bytes_and_no_behaviour(text: str):
    one = source(text)
    expected = behaviour(text)
    made = equivalent_mutants(one)
    assert len(made) > 15
    for change in made:
        new = one.apply(change)
        assert new != text
        assert behaviour(new) == expected, change.words


@pytest.mark.parametrize("text", [toy.CONTROLLER, toy.PROCESSOR])
def test_nearly_every_mutant_changes_behaviour(text: str):
    def differs(change: Change) -> bool:
        try:
            return behaviour(one.apply(change)) != expected
        except Exception:
            return True

    one = source(text)
    expected = behaviour(text)
    made = mutants(one, COURSE)
    assert sum(map(differs, made)) >= 0.9 * len(made)


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("def f(a):\n    return a < 2", "def f(a):\n    return (2 > a)"),
        ("def f(a):\n    return 0.3", "def f(a):\n    return (0.15 + 0.15)"),
        ("def f(a):\n    if a: g()", "def f(a):\n    if [a][0]: g()"),
        ("def f(a):\n    return g(a)", "def f(a):\n    answer2 = (g(a)); return answer2"),
        ("def f(a):\n    g(a)", "def f(a):\n    [g(a)]"),
    ],
)
def test_an_equivalent_mutant_looks_like_a_mutant(before: str, after: str):
    one = source(before)
    assert after in [one.apply(change) for change in equivalent_mutants(one)]
