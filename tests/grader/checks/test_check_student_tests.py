"""T1 and T2: the points for the package's own tests and their coverage, and the feedback."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import pytest
from helpers.judging import Check, Judged, ask, evidence_with

from grader import evidence
from grader.checks import check_student_tests as checks
from grader.checks.judge import Judge, Unjudged
from grader.evidence import FileCoverage, Finding, Manifest, Quality, SourceFile, StudentTests

NODES = ["ros2_robot_controller/robot_controller.py", "ros2_robot_controller/sensor_processor.py"]
HANDED_IN = Quality(Manifest(found=True), files=[SourceFile(path, 90, functions=[[9, 90]]) for path in NODES])
EXIST, ASSERT, PASS, COVER = CHECKS = (
    checks.test_both_nodes_have_tests, checks.test_every_test_asserts_something, checks.test_own_tests_pass,
    checks.test_coverage_of_lines_and_branches,
)  # fmt: skip
NO_TEST = "no test that asserts something runs code of robot_controller or sensor_processor; found "


def module(path: str = "test/test_a.py", **facts: object) -> evidence.TestModule:
    known = {"stub": False, "tests": 4, "asserting": 4, "passed": 4, "reached": NODES, "tested": NODES}
    return evidence.TestModule(path=path, **{**known, **facts})  # type: ignore[arg-type]


def covered(percent: int) -> FileCoverage:
    return FileCoverage(NODES[0], 100, percent, 0, 0, missing=list(range(percent + 1, 101)))


def judged(check: Check, *modules: evidence.TestModule, coverage: int | None = None) -> Judged:
    tests = StudentTests(list(modules), [covered(coverage)] if coverage is not None else [])
    return ask(check, evidence_with(tests=tests, quality=HANDED_IN))


@pytest.mark.parametrize("check", CHECKS)
def test_a_good_suite_passes(check: Check):
    assert judged(check, module(), coverage=95) == Judged(1.0, "")


STUB = module("test/test_flake8.py", stub=True, passed=0)
ONLY_STUBS = "only generated tests that call a linter and do not test the code: test/test_flake8.py"
FOUR = ["test_a", "test_b", "test_c", "test_d"]
SILENT = module(asserting=0, silent=FOUR, tested=[])
IDLE = module(tested=[], idle=FOUR)
ELSEWHERE = module(reached=[], tested=[])
FLICKERS = "these tests passed in one of two runs and failed in the other, so they do not count: test/test_a.py test_b"
LISTED = "4 of 4 tests assert nothing: test/test_a.py test_a, test/test_a.py test_b, test/test_a.py test_c and 1 more"
OF_NOTHING = "no test that passed tests code of the package: test/test_a.py"


@pytest.mark.parametrize(
    ("check", "modules", "share", "seen"),
    [
        (EXIST, [], 0.0, f"{NO_TEST}no tests in test/ or tests/"),
        (ASSERT, [], 0.0, "no tests in test/ or tests/"),
        (PASS, [], None, "no tests in test/ or tests/"),
        (COVER, [], None, "no test ran, so nothing was covered (T1)"),
        (ASSERT, [STUB], 0.0, ONLY_STUBS),
        (PASS, [STUB], None, ONLY_STUBS),
        (EXIST, [SILENT], 0.0, f"{NO_TEST}test/test_a.py (no test that asserts anything)"),
        (ASSERT, [SILENT], 0.0, LISTED),
        (PASS, [SILENT], None, "no test asserts anything, so that they pass shows nothing"),
        (PASS, [module(passed=3, unsteady=["test_b"])], 1.0, FLICKERS),
        (PASS, [module(passed=0, unsteady=["test_b"])], 0.0, FLICKERS),
        # `front_dist = 1.2; assert front_dist > 0.5` is a test of nothing, however often it is written.
        (EXIST, [ELSEWHERE], 0.0, f"{NO_TEST}test/test_a.py (runs no code of the package)"),
        (ASSERT, [ELSEWHERE], 0.0, "no test runs code of the package: test/test_a.py"),
        (PASS, [ELSEWHERE], None, OF_NOTHING),
        # They swallow every failure, or report none; they reach the nodes all the same.
        (EXIST, [IDLE], 0.0, f"{NO_TEST}test/test_a.py (passes whatever the code does)"),
        (ASSERT, [IDLE], 0.0, LISTED),
        (PASS, [IDLE], None, OF_NOTHING),
        # Passing tests of nothing do not hide failing ones, nor a module that cannot be imported.
        (PASS, [module(passed=3, failed=1), replace(ELSEWHERE, passed=96)], 0.75, "3 of 4 tests passed; and 1 more"),
        (PASS, [module(), replace(ELSEWHERE, passed=0, errors=4)], 0.5, "4 of 8 tests passed; and 4 more"),
        (PASS, [module(passed=3, failed=1, failures=["test_d: assert 1 == 2"])], 0.75,
         "3 of 4 tests passed; test_d: assert 1 == 2"),
        (PASS, [module(passed=0, skipped=4)], 0.0, "no test ran: all were skipped"),
        (EXIST, [module(tested=NODES[:1])], 0.5,
         "no test that asserts something runs code of sensor_processor; found test/test_a.py"),
        (EXIST, [module(tested=NODES[:1], starts=["sensor_processor"])], 1.0, ""),
    ],
)  # fmt: skip
def test_what_tests_show_and_what_is_said_of_it(check: Check, modules, share: float | None, seen: str):
    """A share of None: there is nothing to judge."""
    said = judged(check, *modules)
    assert said.seen == seen
    assert (said.share, said.reached) == ((0.0, False) if share is None else (share, True))


def test_a_file_of_tests_with_mocks_only_is_not_asked_for_again():
    mocks = module("test/test_robot_controller.py", reached=[], tested=[])
    assert judged(EXIST, mocks).try_.startswith(
        "test/test_robot_controller.py and test/test_sensor_processor.py must run the node's own code"
    )


def test_a_test_among_others_that_passes_whatever_the_package_does_is_listed():
    some = module(tests=20, asserting=20, idle=["test_a"])
    assert judged(EXIST, some) == Judged(
        1.0,
        "these tests pass although every function that they call raises: test/test_a.py test_a",
        "a test of what goes wrong expects the one error that it is about",
    )
    assert judged(ASSERT, some).share == 0.95


def test_a_file_of_which_nothing_ran_in_a_node_counts_for_nothing(monkeypatch: pytest.MonkeyPatch):
    """Three hundred small functions that only tests call, all of them covered."""
    measured = SimpleNamespace(whole=frozenset(NODES), of_node={"robot_controller": frozenset(NODES[:1])})
    monkeypatch.setattr(Judge, "measured", lambda _: measured)
    pad = "ros2_robot_controller/pad.py"
    tests = StudentTests([module(reached=[pad], tested=[pad])], [covered(0), FileCoverage(pad, 5000, 5000, 0, 0)])
    assert [ask(check, evidence_with(tests=tests)).share for check in CHECKS] == [0.0] * 4


def test_tests_that_sleep_are_named_and_lose_nothing():
    """The contract asks for tests that assert and pass; a sleep only makes them slow and fickle."""
    quality = replace(HANDED_IN, habits=[Finding("test/test_a.py", 12, "sleep-in-test", "`time.sleep(0.5)`")])
    said = ask(PASS, evidence_with(tests=StudentTests([module()]), quality=quality))
    assert (said.share, said.seen) == (
        1.0,
        "these tests sleep, which costs no points, and time in every run: test/test_a.py:12 `time.sleep(0.5)`",
    )


@pytest.mark.parametrize(("percent", "share"), [(0, 0.0), (40, 0.0), (65, 0.5), (89, 0.98), (90, 1.0), (100, 1.0)])
def test_coverage_counts_from_40_to_90_percent(percent: int, share: float):
    said = judged(COVER, module(), coverage=percent)
    assert said.share == pytest.approx(share)
    missing = f"{percent}.0 % covered; not reached: ros2_robot_controller/robot_controller.py lines {percent + 1}"
    assert (missing in said.seen) == (share < 1)


def test_tests_that_were_not_run_are_an_error_of_the_grader():
    with pytest.raises(Unjudged):
        ask(PASS, evidence_with())
