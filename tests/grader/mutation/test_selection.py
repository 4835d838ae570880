"""Which mutants are tried, and with which tests."""

from __future__ import annotations

import random
from collections import Counter

import pytest
from helpers.course import COURSE
from submissions import toy

from grader import KIT
from grader.mutation.operators import mutants
from grader.mutation.selection import Selector, choose
from grader.mutation.source import MUTANTS
from grader.mutation.source_text import Change, SourceText
from grader.student_tests.module_results import ModuleReach

NODE = "ros2_robot_controller/robot_controller.py"
TESTS = "test/test_it.py"
REFERENCE = KIT / "solution_pkg" / "ros2_robot_controller"


def source() -> SourceText:
    return SourceText(NODE, toy.CONTROLLER)


def line_of(words: str) -> int:
    return next(number for number, line in enumerate(toy.CONTROLLER.splitlines(), 1) if words in line)


def mutant_at(words: str) -> Change:
    return next(change for change in mutants(source(), COURSE) if change.line == line_of(words))


def reach(lines: dict[int, set[str]], *, interdependent: bool = False, module: str = TESTS) -> ModuleReach:
    names = sorted({name for tests in lines.values() for name in tests} - {""})
    by_line = {line: frozenset(tests) for line, tests in lines.items()}
    return ModuleReach(module, dict.fromkeys(names, 0.1), {NODE: by_line}, interdependent)


def selected(change: Change, *reaches: ModuleReach, **options: set[str]) -> list[tuple[str, tuple[str, ...]]]:
    found = Selector(reaches).tests(change, **options)
    return [(selection.module, selection.tests) for selection in found]


def everywhere(_change: Change) -> bool:
    return True


def test_mutants_are_spread_over_functions_and_operators():
    everything = mutants(source(), COURSE)
    chosen = choose(everything, 10, everywhere)
    assert len({change.function for change in everything} - {change.function for change in chosen}) <= 1
    assert max(Counter(change.operator for change in chosen).values()) <= 4


def test_a_function_has_mutants_in_proportion():
    """One mutant of each function, however long, misjudged suites that test the long functions only."""
    text = "".join(f"def f{n}(x):\n" + f"    x = x + {n + 1}\n" * (2 + 18 * (n % 2)) for n in range(20))
    everything = mutants(SourceText(NODE, text), COURSE)
    share = sum(int(change.function[1:]) % 2 for change in everything) / len(everything)
    chosen = choose(everything, 40, everywhere)
    assert sum(int(change.function[1:]) % 2 for change in chosen) / len(chosen) == pytest.approx(share, abs=0.06)


@pytest.mark.parametrize("noticed", [0.3, 0.5, 0.7])
def test_mutants_that_are_tried_stand_for_all(noticed: float):
    """Whichever functions a suite tests well; forty mutants that a seed had drawn were off by 0.6 points."""
    texts = [path.read_text() for path in sorted((REFERENCE / "ros2_robot_controller").rglob("*.py"))]
    everything = [
        c for n, text in enumerate(texts) for c in mutants(SourceText(f"ros2_robot_controller/m{n}.py", text), COURSE)
    ]
    errors = []
    for suite in range(200):
        dice = random.Random(suite)
        functions = {(c.path, c.function): dice.betavariate(noticed, 1 - noticed) for c in everything}
        found = {c for c in everything if dice.random() < functions[c.path, c.function]}
        tried = choose(everything, MUTANTS, everywhere)
        errors.append(len(found) / len(everything) - sum(c in found for c in tried) / len(tried))
    points = [error / 0.65 * 6 for error in errors]
    assert (sum(error**2 for error in points) / len(points)) ** 0.5 < 0.55


def test_long_modules_leave_the_others_their_share():
    """A thousand small functions beside nodes of four functions: 40 drawn in proportion left the nodes none."""
    text = "".join(f"def small{n}(x):\n    return x + {n + 1}\n\n\n" for n in range(1000))
    small = SourceText("ros2_robot_controller/small.py", text)
    everything = [*mutants(source(), COURSE), *mutants(small, COURSE)]
    count = Counter(change.path for change in choose(everything, 4, everywhere))
    assert count == {NODE: 2, small.path: 2}


def test_mutants_that_no_test_reaches_are_chosen_in_proportion_and_take_no_place():
    everything = mutants(source(), COURSE)
    reached = {change for change in everything if change.function.endswith("set_speed")}
    chosen = choose(everything, 3, reached.__contains__)
    assert sum(change in reached for change in chosen) == 3
    assert len(chosen) / 3 == pytest.approx(len(everything) / len(reached), rel=0.4)


def test_a_test_that_is_added_leaves_the_same_mutants_to_be_tried_first():
    everything = mutants(source(), COURSE)
    before = choose(everything, 8, lambda change: change.function.endswith("set_speed"))
    assert choose(everything, 8, everywhere) == before[:8]


def test_no_mutant_is_chosen_twice_and_there_may_be_too_few():
    everything = mutants(source(), COURSE)
    chosen = choose(everything, 1000, everywhere)
    assert 15 < len(chosen) == len(everything)
    assert len(set(chosen)) == len(chosen)
    assert choose([], 40, everywhere) == []


def test_only_tests_that_reach_the_line_are_run():
    inside = line_of("self.publish(0.0)")
    assert selected(mutant_at("self.publish(0.0)"), reach({inside: {"a"}, inside + 2: {"b"}})) == [(TESTS, ("a",))]


def test_a_line_that_no_test_reaches_selects_none():
    assert selected(mutant_at("self.publish(0.0)"), reach({1: {"a"}})) == []


def test_the_narrowest_test_comes_first():
    inside = line_of("self.publish(0.0)")
    wide = {number: {"wide"} for number in range(1, 10)}
    assert selected(mutant_at("self.publish(0.0)"), reach({**wide, inside: {"wide", "narrow"}})) == [
        (TESTS, ("narrow", "wide"))
    ]


def test_a_constant_is_reached_by_all_tests_of_a_module_that_imports_it():
    """A module of constants alone has no line that a test runs."""
    bound, other = line_of("TOP_SPEED ="), line_of("self.publish(0.0)")
    imports = reach({bound: {""}, other: {"b", "a"}})
    assert selected(mutant_at("TOP_SPEED ="), imports) == [(TESTS, ("a", "b"))]
    assert selected(mutant_at("TOP_SPEED ="), reach({other: {"a"}})) == []


def test_tests_that_share_a_fixture_run_together_in_their_own_order():
    inside = line_of("self.publish(0.0)")
    lines = {inside: {"b"}, 1: {"a", "b"}, 2: {"a", "b"}}
    assert selected(mutant_at("self.publish(0.0)"), reach(lines, interdependent=True)) == [(TESTS, ("a", "b"))]
    assert selected(mutant_at("self.publish(0.0)"), reach(lines), whole={TESTS}) == [(TESTS, ("a", "b"))]


def test_lines_of_a_shared_fixture_are_reached_by_all_tests_that_share_it():
    inside = line_of("self.publish(0.0)")
    lines = {inside: {""}, 1: {"a", "b"}}
    assert selected(mutant_at("self.publish(0.0)"), reach(lines, interdependent=True)) == [(TESTS, ("a", "b"))]


def test_tests_set_aside_are_not_run():
    inside = line_of("self.publish(0.0)")
    assert selected(mutant_at("self.publish(0.0)"), reach({inside: {"a", "b"}}), without={"a"}) == [(TESTS, ("b",))]


def test_the_module_with_the_narrowest_test_comes_first():
    inside = line_of("self.publish(0.0)")
    wide = reach({number: {"wide"} for number in range(1, inside + 1)}, module="test/test_a.py")
    narrow = reach({inside: {"narrow"}}, module="test/test_b.py")
    found = selected(mutant_at("self.publish(0.0)"), wide, narrow)
    assert [module for module, _ in found] == ["test/test_b.py", "test/test_a.py"]
