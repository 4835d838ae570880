"""F14: a module that cannot be imported is named once, and the advice fits."""

from __future__ import annotations

from dataclasses import replace

import pytest
from helpers.judging import ask, evidence_with

from grader.checks.check_conversions import test_conversions_are_right_at_their_edges as check
from grader.conversions.ask import questions
from grader.evidence import FunctionAnswer

check.__test__ = False  # type: ignore[attr-defined]
MISSING = "ModuleNotFoundError: No module named 'ros2_robot_controller.utils'"


@pytest.fixture
def unanswered() -> list[FunctionAnswer]:
    return [FunctionAnswer(q["function"], q["arguments"], problem=MISSING) for q in questions(0)]


def test_a_module_that_is_not_there_is_named_once(unanswered: list[FunctionAnswer]):
    said = ask(check, evidence_with(conversions=unanswered))
    assert said.share == 0
    assert said.seen == f"utils/conversions.py cannot be imported: {MISSING}"
    assert "CMakeLists.txt" in said.try_


def test_one_function_that_is_missing_costs_a_quarter(unanswered: list[FunctionAnswer]):
    gone = "AttributeError: module has no attribute 'clamp'"
    answers = [FunctionAnswer("clamp", [0.5, 0.0, 1.0], problem=gone), FunctionAnswer("clamp", [2.0, 0.0, 1.0], [1.0])]
    said = ask(check, evidence_with(conversions=[replace(answers[1]), answers[0]]))
    assert said.share == pytest.approx(0.75)
    assert said.seen == f"clamp(0.5000, 0.0000, 1.0000) gave {gone}"
