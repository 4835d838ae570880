"""A found case of the kit's own course as the text of a test: its steps up to the break, and what should hold then."""

from __future__ import annotations

import math
from typing import Any

import pytest
from helpers import judging
from helpers.course import COURSE
from helpers.hunting import NODE

from grader.courses.robot_controller.hunts.bench_tests import _HOLDS, as_test
from grader.evidence import Sample
from grader.trials.case import READINGS, Case, Step
from grader.trials.promises import Broken, Run, hunts

PROMISES = {promise.name: promise for promise in hunts(COURSE).promises}
SPEED = Step("call", {"service": "set_speed", "speed": 0.5})
POLE = Step("obstacle", {"name": "pole 1", "bearing": 46, "distance": 0.3, "radius": 0.15})
GOAL = Step("goal", {"bearing": 30, "distance": 1.5, "tolerance": 0.1})


def wait(seconds: float) -> Step:
    return Step("wait", seconds)


def body(promise: str, t: float, *steps: Step, **fields: Any) -> list[str]:
    """Return the lines of the test function, without that which makes the robot."""
    marks, now = {}, 0.0
    for number, step in enumerate(steps):
        marks[f"{number} {step.do}"] = round(now, 3)
        now += step.to if step.do in ("wait", "arrive") else 0.0
    samples = [Sample(n / 20, 0, 0, 0, 0, 0, 0, 0, 0, 9.0) for n in range(round(20 * now) + 1)]
    run = Run(Case(NODE, steps, heading=90), judging.trial("case-1", NODE, marks=marks, samples=samples))
    text = as_test(run, PROMISES[promise], Broken(t, "seen", fields), "what was done")
    if not text:
        return []
    compile(text, "test_found.py", "exec")
    assert max(len(line) for line in text.splitlines()) <= 99
    return [line.strip() for line in text.partition("\ndef test_")[2].splitlines()[2:]]


def test_the_test_ends_at_the_break_and_says_what_holds_then():
    steps = (wait(0.3), SPEED, wait(0.8), POLE, wait(1.8), Step("remove", "pole 1"), wait(1.0))
    assert body("stops_in_time", 1.55, *steps, late=0.35) == [
        "robot.drive(0.3)",
        "robot.set_speed(0.5)",
        "robot.drive(0.8)",
        "robot.put(name='pole 1', bearing=46, distance=0.3, radius=0.15)",
        "robot.drive(0.45)",
        "# It does not drive on for more than 0.3 s towards what is nearer than",
        "# `obstacle_detection_threshold`.",
        "assert robot.commands[-1].linear.x == 0.0",
    ]


def test_an_answer_is_asserted_at_the_last_call_that_was_done():
    steps = (wait(0.3), SPEED, wait(0.5), Step("call", {"service": "get_status"}), wait(1.0))
    assert body("status_is_true", 0.8, *steps, flag=True)[-3:] == [
        "answer = robot.status()",
        "# The status has the speed in force, what is in the way, and the pose from `odom`.",
        "assert answer.obstacle_detected is False",
    ]
    refused = Step("call", {"service": "set_speed", "speed": -math.inf})
    lines = body("refuses_what_is_too_fast", 0.3, wait(0.3), refused, wait(1.0), taken=True)
    assert (lines[1], lines[-1]) == ("answer = robot.set_speed(-math.inf)", "assert answer.success is False")


def test_a_goal_is_done_to_its_end_where_the_promise_is_about_that():
    arrives = (wait(0.3), GOAL, Step("arrive", 12.0), wait(1.0))
    assert body("arrives_where_it_says", 9.0, *arrives, off=0.4)[:4] == [
        "robot.drive(0.3)",
        "robot.go(bearing=30, distance=1.5, tolerance=0.1)",
        "robot.finish(robot.goal)",
        "robot.drive(1)",
    ]
    assert body("feedback_is_true", 0.35, *arrives, w=[0.35, 1.3, 1.5])[2] == "robot.drive(0.05)"
    cancel = Step("cancel", None)
    assert "robot.drive(1.0)" in body("cancels", 1.3, wait(0.3), GOAL, wait(1.0), cancel, wait(2.4), goal=None)
    assert body("arrives_where_it_says", 9.0, *arrives, cancel, off=0.4) == []  # who knows how it ends elsewhere


@pytest.mark.parametrize("kind", READINGS)
def test_bad_readings_are_those_of_the_case(kind: str):
    steps = (Step("limits", {"least": 0.25, "most": 10.0}), Step("readings", {"kind": kind, "every": 2}), wait(1.0))
    line = body("drives_on", 0.9, *steps, wanted=0.25)[1]
    change = eval(line.removeprefix("robot.change = "), {"math": math})
    expected = READINGS[kind]
    made = [] if expected is None else [expected(0.25, 10.0), 2.0] * 2
    assert repr(change([1.0, 2.0, 3.0, 2.0])) == repr([1.0, 2.0, 3.0, 2.0] if kind == "true" else made)


def test_other_steps_are_done_as_in_the_case():
    parameter = Step("set", {"max_linear_speed": 0.375})
    assert body("drives_on", 9.0, Step("silence", "scan"), wait(0.2), parameter, Step("hear", "imu"), wanted=0.25)[
        :3
    ] == [
        "robot.hears = False",
        "robot.drive(0.2)",
        "robot.bench.set_parameter('max_linear_speed', 0.375)",
    ]


def test_what_has_no_test_on_the_bench_gets_none():
    assert body("ends_on_ctrl_c", 0.3, wait(0.3), Step("interrupt", 5.0)) == []
    assert PROMISES["publishes_in_time"].as_test is None
    assert {name for names, _, _ in _HOLDS for name in names.split()} <= {*PROMISES}
