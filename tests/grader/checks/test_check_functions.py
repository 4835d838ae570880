"""F14: a module that cannot be imported is named once, and the advice fits."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from helpers.course import COURSE
from helpers.judging import ask, evidence_with

from grader.checks.check_functions import test_functions_are_right_at_their_edges as check
from grader.evidence import FunctionAnswer
from grader.functions.source import questions

check.__test__ = False  # type: ignore[attr-defined]
MISSING = "ModuleNotFoundError: No module named 'ros2_robot_controller.utils'"


@pytest.fixture
def unanswered() -> list[FunctionAnswer]:
    return [FunctionAnswer(q["function"], q["arguments"], problem=MISSING) for q in questions(COURSE, 0)]


def test_a_module_that_is_not_there_is_named_once(unanswered: list[FunctionAnswer]):
    said = ask(check, evidence_with(functions=unanswered))
    assert said.share == 0
    assert said.seen == f"ros2_robot_controller/utils/conversions.py cannot be imported: {MISSING}"
    assert "CMakeLists.txt" in said.try_


def test_one_function_that_is_missing_costs_a_quarter(unanswered: list[FunctionAnswer]):
    gone = "AttributeError: module has no attribute 'clamp'"
    answers = [FunctionAnswer("clamp", [0.5, 0.0, 1.0], problem=gone), FunctionAnswer("clamp", [2.0, 0.0, 1.0], [1.0])]
    said = ask(check, evidence_with(functions=[replace(answers[1]), answers[0]]))
    assert said.share == pytest.approx(0.75)
    assert said.seen == f"clamp(0.5000, 0.0000, 1.0000) gave {gone}; right is 0.5000"


def test_a_wrong_answer_comes_with_its_case_and_the_right_one():
    tilted = [-0.3, 0.6, 0.2, 0.7141428428542851]
    naive = 2 * math.atan2(tilted[2], tilted[3])
    answers = [
        FunctionAnswer("normalize_angle", [-math.pi], [-math.pi]),
        FunctionAnswer("quaternion_from_yaw", [math.pi], [0.0, 1.0, 0.0, 0.0]),
        FunctionAnswer("yaw_from_quaternion", [tilted], [naive]),
        FunctionAnswer("clamp", [-3.0, -1.0, -0.5], [-3.0]),
    ]
    assert ask(check, evidence_with(functions=answers)).seen.split("; right is ") == [
        "normalize_angle(-3.1416) gave -3.1416",
        "3.1416; quaternion_from_yaw(3.1416) gave (0.000, 1.000, 0.000, 0.000)",
        "(0.000, 0.000, 1.000, 0.000); yaw_from_quaternion((-0.300, 0.600, 0.200, 0.714)) gave 0.5461",
        "-0.3559; clamp(-3.0000, -1.0000, -0.5000) gave -3.0000",
        "-1.0000",
    ]
