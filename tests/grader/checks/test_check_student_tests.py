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


def module(path: str = "test/test_a.py", **facts: object) -> evidence.TestModule:
    known = {"stub": False, "tests": 4, "asserting": 4, "passed": 4, "reached": NODES, "tested": NODES}
    return evidence.TestModule(path=path, **{**known, **facts})  # type: ignore[arg-type]


def covered(percent: int) -> FileCoverage:
    return FileCoverage(NODES[0], 100, percent, 0, 0, missing=list(range(percent + 1, 101)))


def judged(check: Check, *modules: evidence.TestModule, coverage: int | None = None) -> Judged:
    tests = StudentTests(list(modules), [covered(coverage)] if coverage is not None else [])
    return ask(check, evidence_with(tests=tests, quality=HANDED_IN))


@pytest.mark.parametrize(
    "check",
    [
        checks.test_both_nodes_have_tests, checks.test_every_test_asserts_something, checks.test_own_tests_pass,
        checks.test_coverage_of_lines_and_branches,
    ],
)  # fmt: skip
def test_a_good_suite_passes(check: Check):
    assert judged(check, module(), coverage=95) == Judged(1.0, "")


def test_without_tests_each_check_says_so():
    assert judged(checks.test_both_nodes_have_tests).seen == (
        "no test that asserts something runs code of robot_controller or sensor_processor; "
        "found no tests in test/ or tests/"
    )
    for check, seen, reached in (
        (checks.test_every_test_asserts_something, "no tests in test/ or tests/", True),
        (checks.test_own_tests_pass, "no tests in test/ or tests/", False),
        (checks.test_coverage_of_lines_and_branches, "no test ran, so nothing was covered (T1)", False),
    ):
        said = judged(check)
        assert (said.share, said.seen, said.reached) == (0.0, seen, reached)


def test_linter_stubs_are_named_and_do_not_count():
    stub = module("test/test_flake8.py", stub=True, passed=0)
    seen = "only generated tests that call a linter and do not test the code: test/test_flake8.py"
    assert judged(checks.test_every_test_asserts_something, stub).seen == seen
    assert judged(checks.test_own_tests_pass, stub).seen == seen


def test_tests_that_assert_nothing_are_named_and_their_passing_does_not_count():
    silent = module(asserting=0, silent=["test_a", "test_b", "test_c", "test_d"], tested=[])
    said = judged(checks.test_every_test_asserts_something, silent)
    assert said.share == 0.0
    assert said.seen.startswith("4 of 4 tests assert nothing: test/test_a.py test_a, test/test_a.py test_b, ")
    assert said.seen.endswith("test_c and 1 more")
    assert judged(checks.test_both_nodes_have_tests, silent).seen.endswith(
        "found test/test_a.py (no test that asserts anything)"
    )
    assert (
        judged(checks.test_own_tests_pass, silent).seen == "no test asserts anything, so that they pass shows nothing"
    )


def test_tests_that_are_not_steady_count_neither_way_and_are_named():
    loose = module(passed=3, unsteady=["test_b"])
    said = judged(checks.test_own_tests_pass, loose)
    words = "these tests passed in one of two runs and failed in the other, so they do not count: test/test_a.py test_b"
    assert (said.share, said.seen) == (1.0, words)
    said = judged(checks.test_own_tests_pass, module(passed=0, unsteady=["test_b"]))
    assert (said.share, said.seen) == (0.0, words)


def test_tests_that_run_no_code_of_the_package_earn_nothing():
    """`front_dist = 1.2; assert front_dist > 0.5` is a test of nothing, however often it is written."""
    nothing = module(reached=[], tested=[])
    said = judged(checks.test_both_nodes_have_tests, nothing)
    assert (said.share, said.seen) == (
        0.0,
        "no test that asserts something runs code of robot_controller or sensor_processor; "
        "found test/test_a.py (runs no code of the package)",
    )
    said = judged(checks.test_every_test_asserts_something, nothing)
    assert (said.share, said.seen) == (0.0, "no test runs code of the package: test/test_a.py")
    said = judged(checks.test_own_tests_pass, nothing)
    assert (said.share, said.reached) == (0.0, False)
    assert said.seen == "no test that passed tests code of the package: test/test_a.py"


def test_a_file_of_tests_with_mocks_only_is_not_asked_for_again():
    mocks = module("test/test_robot_controller.py", reached=[], tested=[])
    said = judged(checks.test_both_nodes_have_tests, mocks)
    assert said.try_ == (
        "write test/test_sensor_processor.py; importing a node does not test it; test_robot_controller.py must run the "
        "node's own code: make the node (after rclpy.init()) or call its functions. A mock in the node's place tests "
        "the mock"
    )


def test_passing_tests_of_nothing_do_not_hide_failing_ones():
    nothing = module("test/test_b.py", tests=96, asserting=96, passed=96, reached=[], tested=[])
    said = judged(checks.test_own_tests_pass, module(passed=3, failed=1), nothing)
    assert (said.share, said.seen) == (0.75, "3 of 4 tests passed; and 1 more")
    broken = module("test/test_b.py", passed=0, errors=4, reached=[], tested=[])
    assert judged(checks.test_own_tests_pass, module(), broken).share == 0.5, "a module that cannot be imported"


def test_tests_that_pass_whatever_the_package_does_earn_nothing():
    """They swallow every failure, or report none; they reach the nodes all the same."""
    idle = module(tested=[], idle=["test_a", "test_b", "test_c", "test_d"])
    said = judged(checks.test_both_nodes_have_tests, idle)
    assert said.share == 0.0
    assert said.seen.endswith("found test/test_a.py (passes whatever the code does)")
    said = judged(checks.test_every_test_asserts_something, idle)
    assert said.share == 0.0
    assert said.seen.startswith("4 of 4 tests assert nothing: test/test_a.py test_a, test/test_a.py test_b, ")
    said = judged(checks.test_own_tests_pass, idle)
    assert (said.share, said.reached) == (0.0, False)


def test_a_test_among_others_that_passes_whatever_the_package_does_is_listed():
    some = module(tests=20, asserting=20, idle=["test_a"])
    assert judged(checks.test_both_nodes_have_tests, some) == Judged(
        1.0,
        "these tests pass although every function that they call raises: test/test_a.py test_a",
        "a test of what goes wrong expects the one error that it is about",
    )
    assert judged(checks.test_every_test_asserts_something, some).share == 0.95


def test_a_node_whose_program_is_started_is_tested():
    assert judged(checks.test_both_nodes_have_tests, module(tested=NODES[:1], starts=["sensor_processor"])).share == 1.0


def test_a_file_of_which_nothing_ran_in_a_node_counts_for_nothing(monkeypatch: pytest.MonkeyPatch):
    """Three hundred small functions that only tests call, all of them covered."""
    measured = SimpleNamespace(whole=frozenset(NODES), of_node={"robot_controller": frozenset(NODES[:1])})
    monkeypatch.setattr(Judge, "measured", lambda _: measured)
    pad = "ros2_robot_controller/pad.py"
    only_pad = module(reached=[pad], tested=[pad])
    tests = StudentTests([only_pad], [covered(0), FileCoverage(pad, 5000, 5000, 0, 0)])
    for check in (
        checks.test_both_nodes_have_tests, checks.test_every_test_asserts_something, checks.test_own_tests_pass,
        checks.test_coverage_of_lines_and_branches,
    ):  # fmt: skip
        assert ask(check, evidence_with(tests=tests)).share == 0.0


def test_a_node_without_tests_costs_half():
    said = judged(checks.test_both_nodes_have_tests, module(tested=NODES[:1]))
    assert said.share == 0.5
    assert "runs code of sensor_processor; found test/test_a.py" in said.seen


def test_failing_tests_cost_their_share_and_say_how():
    said = judged(checks.test_own_tests_pass, module(passed=3, failed=1, failures=["test_d: assert 1 == 2"]))
    assert (said.share, said.seen) == (0.75, "3 of 4 tests passed; test_d: assert 1 == 2")


def test_tests_that_sleep_are_named_and_lose_nothing():
    """The contract asks for tests that assert and pass; a sleep only makes them slow and fickle."""
    naps = Finding("test/test_a.py", 12, "sleep-in-test", "`time.sleep(0.5)`")
    quality = replace(HANDED_IN, habits=[naps])
    said = ask(checks.test_own_tests_pass, evidence_with(tests=StudentTests([module()]), quality=quality))
    assert (said.share, said.seen) == (
        1.0,
        "these tests sleep, which costs no points, and time in every run: test/test_a.py:12 `time.sleep(0.5)`",
    )


def test_skipping_everything_does_not_pass():
    said = judged(checks.test_own_tests_pass, module(passed=0, skipped=4))
    assert (said.share, said.seen) == (0.0, "no test ran: all were skipped")


@pytest.mark.parametrize(("percent", "share"), [(0, 0.0), (40, 0.0), (65, 0.5), (89, 0.98), (90, 1.0), (100, 1.0)])
def test_coverage_counts_from_40_to_90_percent(percent: int, share: float):
    said = judged(checks.test_coverage_of_lines_and_branches, module(), coverage=percent)
    assert said.share == pytest.approx(share)
    missing = f"{percent}.0 % covered; not reached: ros2_robot_controller/robot_controller.py lines {percent + 1}"
    assert (missing in said.seen) == (share < 1)


def test_tests_that_were_not_run_are_an_error_of_the_grader():
    with pytest.raises(Unjudged):
        ask(checks.test_own_tests_pass, evidence_with())
