"""Q6: the demonstration as a trial saw it, and test_results.xml."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from helpers.judging import trial
from helpers.quality_examples import Judged, facts, judged, untouched, written

from grader import evidence
from grader.checks.check_handed_in import test_demonstration_runs as demonstration
from grader.checks.check_handed_in import test_test_results_match_the_tests as results
from grader.evidence import Kind, Reason

# -- the demonstration ------------------------------------------------------------------------------------------------

CALLED = evidence.Call(1.0, "set_speed", {"speed": 0.1}, {"success": True, "message": "ok"})
SENT = evidence.Call(1.5, "navigate_to_position/_action/send_goal", {"goal": "ab"}, {"accepted": True})
GOAL = evidence.Message(2.0, "navigate_to_position/_action/status", {"goal": "ab", "status": 4})
WELL = evidence.ProcessEnd("itself", 0, 4.0, "arrived\n")


def seen(
    end: evidence.ProcessEnd | None, *, calls: bool = True, goals: bool = True, ended: Reason | None = None
) -> Judged:
    told = [CALLED] * calls + [SENT] * goals
    return of_demo(end, ended=ended, calls=told, messages=[GOAL] if goals else [])


def of_demo(end: evidence.ProcessEnd | None, build: evidence.Build | None = None, **facts: Any) -> Judged:
    """Return what is said of a demonstration that ended so, in a trial with these facts."""
    others = {"demo.py": end} if end else {}
    run = trial("demo", ready=end is not None, pace="real time", others=others, **facts)
    return judged(demonstration, untouched(), trials={"demo": run}, **({"build": build} if build else {}))


def test_a_missing_script_gets_nothing(tmp_path: Path):
    result = judged(demonstration, facts(written(tmp_path, {"scripts/show.py": "X = 1\n"})))
    assert result.share == 0.0
    assert "there is no scripts/demo.py" in result.seen


@pytest.mark.parametrize(
    ("end", "calls", "goals", "share", "words"),
    [
        (WELL, True, True, 1.0, ""),
        (WELL, False, True, 0.75, "it called none of "),
        (WELL, False, False, 0.0, "it called none of "),
        (replace(WELL, exit_code=1, output_tail="Traceback\nNameError: name 'rclpy'\n"), False, False, 0.0, "'rclpy'"),
        (replace(WELL, by="us", exit_code=None, wall_seconds=61.0), True, True, 0.5, "had not ended after 61 s"),
        (replace(WELL, exit_code=-11), False, True, 0.25, "exit status -11"),
        (replace(WELL, exit_code=-11), True, False, 0.25, "it sent no goal to "),
    ],
    ids=["all", "no service", "only exits", "a traceback", "never ends", "crashes, no service", "crashes, no goal"],
)
def test_each_part_of_a_demonstration_counts(end, calls: bool, goals: bool, share: float, words: str):
    result = seen(end, calls=calls, goals=goals)
    assert result.share == share
    assert words in result.seen


@pytest.mark.parametrize("calls", [[], [replace(SENT, response={"accepted": False})], [replace(SENT, response=None)]])
def test_a_status_without_a_goal_that_the_node_accepted_is_no_goal(calls: list[evidence.Call]):
    """A script published it itself, and no node offered the action."""
    result = of_demo(WELL, calls=[CALLED, *calls], messages=[GOAL])
    assert result.share == 0.75
    assert "it sent no goal to navigate_to_position" in result.seen


RCLPY = "/usr/lib/python3/dist-packages/rclpy"
IN_DESTROY_NODE = f"""arrived
Fatal Python error: Segmentation fault

Current thread 0x00007f0b (most recent call first):
  File "{RCLPY}/node.py", line 2011 in destroy_node
  File "/ws/submission/scripts/demo.py", line 88 in main
"""
STILL_SPINS = f"""
Thread 0x00007f0a (most recent call first):
  File "{RCLPY}/executors.py", line 700 in _wait_for_ready_callbacks
"""


@pytest.mark.parametrize("output", ["arrived\n", IN_DESTROY_NODE])
def test_a_crash_in_the_libraries_own_end_costs_nothing(output: str):
    """Three correct demonstrations lost a point each for exit status -11."""
    result = seen(replace(WELL, exit_code=-11, output_tail=output))
    assert result.share == 1.0
    assert "exit status -11" in result.seen


@pytest.mark.parametrize(
    ("exit_code", "output"),
    [
        (-11, IN_DESTROY_NODE + STILL_SPINS),
        (-11, IN_DESTROY_NODE.replace(RCLPY, "/ws/submission/scripts")),
        (-11, "arrived\nTraceback (most recent call last)\nValueError: no\n"),
        (-6, "arrived\nterminate called without an active exception\n"),
        (-9, "arrived\n"),
        (1, "arrived\n"),
    ],
    ids=["a thread still spins", "in its own code", "a traceback", "a daemon thread", "killed", "exit status 1"],
)
def test_any_other_end_with_a_status_costs_half(exit_code: int, output: str):
    assert seen(replace(WELL, exit_code=exit_code, output_tail=output)).share == 0.5


def test_waiting_for_an_answer_that_rclpy_dropped_costs_nothing():
    waits = replace(WELL, by="us", exit_code=None, output_tail="[WARN] Ignoring unexpected goal response. There may be")
    assert (seen(waits).share, seen(replace(waits, output_tail="")).share) == (1.0, 0.5)
    assert "ros2/rclpy#1123" in seen(waits).seen


def test_a_crash_before_the_goal_has_ended_costs_half(monkeypatch: pytest.MonkeyPatch):
    """Killing oneself with SIGSEGV is no way to a full demonstration."""
    monkeypatch.setitem(GOAL.data, "status", 2)
    assert seen(replace(WELL, exit_code=-11)).share == 0.5


@pytest.mark.parametrize(
    ("end", "ended"),
    [
        (replace(WELL, by="us", exit_code=None), Reason(Kind.DIED, exit_code=1, seconds=3.0)),
        (None, Reason(Kind.DIED_EARLY, exit_code=1)),
    ],
    ids=["dies meanwhile", "does not come up"],
)
def test_a_node_that_dies_is_not_held_against_the_demonstration(end: evidence.ProcessEnd | None, ended: Reason):
    result = seen(end, ended=ended)
    assert result.reached is False
    assert end is None or "the node ended at 3.00 s" in result.seen


def test_services_of_other_types_cannot_be_judged():
    """They cost points in I3; the observer cannot see calls of another type."""
    build = evidence.Build(True, True, 0, 0, False, "", contract_hashes={"srv/SetSpeed": "RIHS01_a"})
    result = of_demo(replace(WELL, exit_code=1), build)
    assert result.reached is False
    assert "srv/SetSpeed" in result.seen


# -- test_results.xml -------------------------------------------------------------------------------------------------

TESTS = {
    "test/test_robot_controller.py": "def test_a():\n    assert 1\n\n\ndef test_b():\n    assert 1\n",
    "test/test_sensor_processor.py": "class TestIt:\n    def test_c(self):\n        assert 1\n",
}
CASES = (
    ("test.test_robot_controller", "test_a"),
    ("test.test_robot_controller", "test_b[0.5-x]"),
    ("test.test_sensor_processor.TestIt", "test_c"),
)


def report(*cases: tuple[str, str], root: str = "testsuites") -> str:
    inner = "".join(f'<testcase classname="{where}" name="{name}" time="0.1" />' for where, name in cases)
    return f'<?xml version="1.0"?><{root}><testsuite name="pytest">{inner}</testsuite></{root}>'


def result_of(tmp_path: Path, xml: str | bytes, tests: dict[str, str] = TESTS) -> Judged:
    return judged(results, facts(written(tmp_path, {**tests, "test_results.xml": xml}), tests=True))


@pytest.mark.parametrize(
    ("cases", "way"),
    [
        ([(where.removeprefix("test."), name) for where, name in CASES], "pytest started in test/"),
        ([(f"src.ros2_robot_controller.{where}", name) for where, name in CASES], "pytest started in the workspace"),
        ([(f"ros2_robot_controller.{where}", name) for where, name in CASES], "colcon test"),
        ([("", name) for _, name in CASES], "no class names"),
        ([*CASES, ("test.test_robot_controller", "test_b[1.0-y]")], "parametrized"),
    ],
)  # fmt: skip
def test_the_folder_where_pytest_was_started_does_not_matter(tmp_path: Path, cases: list[tuple[str, str]], way: str):
    assert result_of(tmp_path, report(*cases)).share == 1.0, way


BARE = "".join(f'<testcase classname="{where}" name="{name}" />' for where, name in CASES)
FAILED = report(*CASES).replace('name="test_a" time="0.1" />', 'name="test_a"><failure message="no"/></testcase>')


@pytest.mark.parametrize("xml", [f"<testsuite>{BARE}</testsuite>", FAILED], ids=["a bare testsuite", "a failed test"])
def test_other_reports_count_too(tmp_path: Path, xml: str):
    """T1 judges whether the tests pass."""
    assert result_of(tmp_path, xml).share == 1.0


@pytest.mark.parametrize(
    ("cases", "share", "words"),
    [
        (CASES, 1.0, ""),
        (CASES[:2], 2 / 3, "not in the report: test_sensor_processor::test_c"),
        ((*CASES, ("test.test_robot_controller", "test_old")), 3 / 4, "test_old"),
        ([("test.test_flake8", "test_flake8")], 0.0, "not in the package: test.test_flake8::test_flake8"),
    ],
    ids=["all", "without the last", "with a removed one", "of another package"],
)
def test_a_report_earns_by_the_tests_that_it_shares_with_the_package(tmp_path: Path, cases, share: float, words: str):
    result = result_of(tmp_path, report(*cases))
    assert result.share == pytest.approx(share)
    assert words in result.seen


def test_a_package_without_tests_has_nothing_to_report(tmp_path: Path):
    assert result_of(tmp_path, report(*CASES), tests={}).share == 0.0


BOMB = '<!DOCTYPE x [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;">]><testsuites>&b;</testsuites>'


@pytest.mark.parametrize(
    ("xml", "said"),
    [
        (BOMB, "DOCTYPE"),
        ('<!DOCTYPE x SYSTEM "file:///etc/passwd"><testsuites/>', "DOCTYPE"),
        ("not xml", "is not XML"),
        ("", "is not XML"),
        ("<html></html>", "begins with <html>"),
        (b"<testsuites>" + b" " * 5_000_000 + b"</testsuites>", "larger than 4 MB"),
        ("<testsuites>" + "<a>" * 200_000, "is not XML"),
        ('<?xml version="1.0" encoding="no-such"?><testsuites/>', "is not XML"),
    ],
)
def test_other_files_are_reported_and_never_expanded(tmp_path: Path, xml: str | bytes, said: str):
    result = result_of(tmp_path, xml)
    assert result.share == 0.0
    assert said in result.seen
