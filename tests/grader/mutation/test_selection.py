"""Which faults are tried, and by which tests."""

from __future__ import annotations

import random
from collections import Counter

import pytest
from submissions import toy

from grader.mutation.operators import mutants
from grader.mutation.selection import Selector, choose
from grader.mutation.source_text import Change, Source, parse
from grader.student_tests.suite_run import Reach

NODE = "ros2_robot_controller/robot_controller.py"
TESTS = "test/test_it.py"


def source(path: str = NODE, text: str = toy.CONTROLLER) -> Source:
    found = parse(path, text)
    assert found is not None
    return found


def line_of(words: str, text: str = toy.CONTROLLER) -> int:
    return next(number for number, line in enumerate(text.splitlines(), 1) if words in line)


def fault_at(words: str) -> Change:
    return next(change for change in mutants(source()) if change.line == line_of(words))


def reach(lines: dict[int, set[str]], *, whole: bool = False, module: str = TESTS) -> Reach:
    names = sorted({name for tests in lines.values() for name in tests} - {""})
    return Reach(module, dict.fromkeys(names, 0.1), {NODE: {k: frozenset(v) for k, v in lines.items()}}, whole)


def selected(change: Change, *reaches: Reach, **options: set[str]) -> list[tuple[str, tuple[str, ...]]]:
    found = Selector({NODE: source()}, reaches).tests(change, **options)
    return [(selection.module, selection.tests) for selection in found]


def test_the_seed_decides():
    everything = mutants(source())
    one, two, other = (choose(everything, 10, random.Random(seed)) for seed in (1, 1, 2))
    assert one == two
    assert one != other


def test_faults_are_spread_over_functions_and_kinds():
    everything = mutants(source())
    chosen = choose(everything, 10, random.Random(0))
    assert {change.function for change in chosen} == {change.function for change in everything}
    assert max(Counter(change.operator for change in chosen).values()) <= 4


def test_no_fault_is_chosen_twice_and_few_are_enough():
    everything = mutants(source())
    chosen = choose(everything, 1000, random.Random(0))
    assert 15 < len(chosen) <= len(everything)
    assert len(set(chosen)) == len(chosen)
    assert choose([], 40, random.Random(0)) == []


def test_only_tests_that_reach_the_line_are_run():
    inside = line_of("self.publish(0.0)")
    assert selected(fault_at("self.publish(0.0)"), reach({inside: {"a"}, inside + 2: {"b"}})) == [(TESTS, ("a",))]


def test_a_line_that_no_test_reaches_selects_none():
    assert selected(fault_at("self.publish(0.0)"), reach({1: {"a"}})) == []


def test_the_narrowest_test_comes_first():
    inside = line_of("self.publish(0.0)")
    wide = {number: {"wide"} for number in range(1, 10)}
    assert selected(fault_at("self.publish(0.0)"), reach({**wide, inside: {"wide", "narrow"}})) == [
        (TESTS, ("narrow", "wide"))
    ]


def test_a_constant_is_reached_by_those_who_use_it():
    """TOP_SPEED is bound on import, in no test; it is used in set_speed."""
    bound, used, other = line_of("TOP_SPEED ="), line_of("> TOP_SPEED"), line_of("self.publish(0.0)")
    assert selected(fault_at("TOP_SPEED ="), reach({bound: {""}, used: {"a"}, other: {"b"}})) == [(TESTS, ("a",))]


def test_a_constant_that_nobody_is_seen_to_use_concerns_all_who_use_the_module():
    bound, other = line_of("TOP_SPEED ="), line_of("self.publish(0.0)")
    assert selected(fault_at("TOP_SPEED ="), reach({bound: {""}, other: {"b"}})) == [(TESTS, ("b",))]


def test_tests_that_share_a_fixture_run_together_in_their_own_order():
    inside = line_of("self.publish(0.0)")
    lines = {inside: {"b"}, 1: {"a", "b"}, 2: {"a", "b"}}
    assert selected(fault_at("self.publish(0.0)"), reach(lines, whole=True)) == [(TESTS, ("a", "b"))]
    assert selected(fault_at("self.publish(0.0)"), reach(lines), whole={TESTS}) == [(TESTS, ("a", "b"))]


def test_lines_of_a_shared_fixture_concern_all_who_share_it():
    inside = line_of("self.publish(0.0)")
    lines = {inside: {""}, 1: {"a", "b"}}
    assert selected(fault_at("self.publish(0.0)"), reach(lines, whole=True)) == [(TESTS, ("a", "b"))]


def test_tests_set_aside_are_not_asked():
    inside = line_of("self.publish(0.0)")
    assert selected(fault_at("self.publish(0.0)"), reach({inside: {"a", "b"}}), without={"a"}) == [(TESTS, ("b",))]


def test_the_module_with_the_narrowest_test_comes_first():
    inside = line_of("self.publish(0.0)")
    wide = reach({number: {"wide"} for number in range(1, inside + 1)}, module="test/test_a.py")
    narrow = reach({inside: {"narrow"}}, module="test/test_b.py")
    found = selected(fault_at("self.publish(0.0)"), wide, narrow)
    assert [module for module, _ in found] == ["test/test_b.py", "test/test_a.py"]


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_one_line_is_not_asked_about_twice_in_the_same_way(seed: int):
    chosen = choose(mutants(source()), 1000, random.Random(seed))
    assert len({(c.path, c.line, c.operator) for c in chosen}) == len(chosen)
