"""T1 to T3 judged over evidence: points, and the sentence that explains them."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from grader import evidence
from grader.checks import check_mutation as t3
from grader.checks import check_student_tests as t12
from grader.checks.judge import Failed, Judge, NotReached, Unjudged
from grader.evidence import EquivalentMutant, FileCoverage, Mutant, Mutation, StudentTests

INTAKE = evidence.Intake("team07.zip", "0" * 64, "ros2_robot_controller", "ros2_robot_controller")
BUILD = evidence.Build(
    ok=True, cached=False, wall_seconds=1.0, exit_code=0, timed_out=False, log_tail="", executables=[]
)
PLACE = "ros2_robot_controller/a.py:7 `<` became `>=` in `d < limit`"
BOTH = ["robot_controller", "sensor_processor"]


def module(path: str = "test/test_a.py", **facts: object) -> evidence.TestModule:
    known: dict[str, object] = {
        "stub": False, "tests": 4, "asserting": 4, "subjects": BOTH, "passed": 4,
    }  # fmt: skip
    return evidence.TestModule(path=path, **{**known, **facts})  # type: ignore[arg-type]


def covered(percent: int) -> FileCoverage:
    lines = 100
    return FileCoverage("ros2_robot_controller/a.py", lines, percent, 0, 0, missing=list(range(percent + 1, lines + 1)))


def faults(noticed: int, unnoticed: int = 0, unreached: int = 0) -> list[Mutant]:
    where = ("ros2_robot_controller/a.py", 7, "drive", "comparison", "`<` became `>=` in `d < limit`")
    tried = ["test/test_a.py::test_one", "test/test_a.py::test_two[0.5]", "test/test_a.py::test_three"]
    return [
        *[Mutant(*where, "noticed", by="test/test_a.py::test_one")] * noticed,
        *[Mutant(*where, "unnoticed", tried=tried)] * unnoticed,
        *[Mutant(*where, "unreached")] * unreached,
    ]


def judge(
    check: Callable[[Judge], None], tests: StudentTests | None, mutation: Mutation | None = None
) -> tuple[float, str]:
    """Return the share of its points that a check gives, and what it says."""
    found = Judge(evidence.Evidence(INTAKE, BUILD, tests=tests, mutation=mutation))
    try:
        check(found)
    except Failed as failed:
        return 0.0, failed.seen
    return found.fraction, found.seen


def unreached(check: Callable[[Judge], None], tests: StudentTests, mutation: Mutation | None = None) -> str:
    with pytest.raises(NotReached) as caught:
        check(Judge(evidence.Evidence(INTAKE, BUILD, tests=tests, mutation=mutation)))
    return str(caught.value)


def test_a_good_suite_has_it_all():
    tests = StudentTests([module()], [covered(95)])
    mutation = Mutation(0, 300, faults(8, 2))
    for check in (
        t12.test_both_nodes_have_tests, t12.test_every_test_asserts_something, t12.test_own_tests_pass,
        t12.test_coverage_of_lines_and_branches,
    ):  # fmt: skip
        assert judge(check, tests) == (1.0, "")
    assert judge(t3.test_mutants_are_noticed, tests, mutation) == (1.0, "")
    assert judge(t3.test_most_mutants_are_noticed, tests, mutation) == (1.0, "")


def test_without_tests_each_says_so():
    tests = StudentTests()
    assert judge(t12.test_both_nodes_have_tests, tests)[1] == (
        "no test that asserts something uses robot_controller or sensor_processor; found no tests in test/ or tests/"
    )
    assert judge(t12.test_every_test_asserts_something, tests) == (0.0, "no tests in test/ or tests/")
    assert unreached(t12.test_own_tests_pass, tests) == "no tests in test/ or tests/"
    assert unreached(t12.test_coverage_of_lines_and_branches, tests) == "no test ran, so nothing was covered (T1)"
    assert "none of the package's own tests passed" in unreached(t3.test_mutants_are_noticed, tests, Mutation(0, 9))


def test_stubs_are_named_and_are_no_tests():
    tests = StudentTests([module("test/test_flake8.py", stub=True, passed=0)])
    said = "only generated tests that call a linter and do not test the code: test/test_flake8.py"
    assert judge(t12.test_every_test_asserts_something, tests) == (0.0, said)
    assert unreached(t12.test_own_tests_pass, tests) == said


def test_tests_that_assert_nothing_are_named_and_passing_says_nothing():
    tests = StudentTests([module(asserting=0, silent=["test_a", "test_b", "test_c", "test_d"])], [covered(95)])
    share, said = judge(t12.test_every_test_asserts_something, tests)
    assert share == 0.0
    assert said.startswith("4 of 4 tests assert nothing: test/test_a.py test_a, test/test_a.py test_b, test/test_a.py")
    assert said.endswith("test_c and 1 more")
    assert judge(t12.test_both_nodes_have_tests, tests)[1].endswith(
        "found test/test_a.py (no test that asserts anything)"
    )
    assert unreached(t12.test_own_tests_pass, tests) == "no test asserts anything, so that they pass shows nothing"


def test_a_node_without_tests_costs_its_half():
    share, said = judge(t12.test_both_nodes_have_tests, StudentTests([module(subjects=["robot_controller"])]))
    assert share == 0.5
    assert "uses sensor_processor; found test/test_a.py" in said


def test_failing_tests_cost_their_share_and_say_how():
    tests = StudentTests([module(passed=3, failed=1, failures=["test_d: assert 1 == 2"])])
    assert judge(t12.test_own_tests_pass, tests) == (0.75, "3 of 4 tests passed; test_d: assert 1 == 2")


def test_skipping_everything_is_no_pass():
    tests = StudentTests([module(passed=0, skipped=4)])
    assert judge(t12.test_own_tests_pass, tests) == (0.0, "no test ran: all were skipped")


@pytest.mark.parametrize(("percent", "share"), [(0, 0.0), (40, 0.0), (65, 0.5), (89, 0.98), (90, 1.0), (100, 1.0)])
def test_coverage_counts_from_40_to_90_percent(percent: int, share: float):
    found, said = judge(t12.test_coverage_of_lines_and_branches, StudentTests([module()], [covered(percent)]))
    assert found == pytest.approx(share)
    assert (f"{percent}.0 % covered; not reached: ros2_robot_controller/a.py lines {percent + 1}" in said) == (
        share < 1
    )


@pytest.mark.parametrize(
    ("noticed", "core", "advanced"),
    [(0, 0.0, 0.0), (4, 0.0, 0.0), (17, 1.0, 0.0), (30, 1.0, 1.0), (40, 1.0, 1.0)],
)
def test_faults_count_from_10_to_75_percent_core_first(noticed: int, core: float, advanced: float):
    """10 % of 40 faults are 4, 42.5 % are 17, 75 % are 30."""
    tests, mutation = StudentTests([module()]), Mutation(0, 300, faults(noticed, 40 - noticed))
    assert judge(t3.test_mutants_are_noticed, tests, mutation)[0] == pytest.approx(core)
    assert judge(t3.test_most_mutants_are_noticed, tests, mutation)[0] == pytest.approx(advanced)


@pytest.mark.parametrize("noticed", range(4, 31))
def test_the_two_halves_make_one_line(noticed: int):
    tests, mutation = StudentTests([module()]), Mutation(0, 300, faults(noticed, 40 - noticed))
    total = sum(
        3 * judge(check, tests, mutation)[0]
        for check in (t3.test_mutants_are_noticed, t3.test_most_mutants_are_noticed)
    )
    assert total == pytest.approx(6 * (noticed / 40 - 0.10) / 0.65)


def test_each_unnoticed_fault_is_told_with_place_words_and_the_tests_that_passed():
    tests, mutation = StudentTests([module()]), Mutation(0, 300, faults(1, 1, 1))
    _, said = judge(t3.test_mutants_are_noticed, tests, mutation)
    assert said.splitlines() == [
        "1 of 3 faults were noticed, 33.3 %",
        f"{PLACE}: test_one, test_two[0.5] and 1 more passed all the same",
        f"{PLACE}: no test reaches this line",
    ]


def test_a_long_list_ends_with_how_many_more():
    _, said = judge(t3.test_mutants_are_noticed, StudentTests([module()]), Mutation(0, 300, faults(0, 30, 10)))
    assert len(said.splitlines()) == 10
    assert said.endswith("and 32 more")


def test_faults_that_were_not_tried_do_not_count():
    cut = [Mutant("a.py", 1, "f", "sign", "", "not tried")] * 20
    note = "20 of 40 faults were not tried: the budget of 20 s was used up"
    mutation = Mutation(0, 300, [*faults(2, 18), *cut], note=note)
    _, said = judge(t3.test_most_mutants_are_noticed, StudentTests([module()]), mutation)
    assert said.startswith(f"2 of 20 faults were noticed, 10 %; {note}\n")


def test_a_suite_that_fails_on_equivalent_mutants_gets_nothing_and_says_why():
    decoys = [EquivalentMutant("a.py", 3, "`0.5` was written as `(0.25 + 0.25)`", 4, ["test/test_a.py::test_hash"])]
    mutation = Mutation(0, 300, faults(40), decoys, convicted=["test/test_a.py::test_hash"])
    for check in (t3.test_mutants_are_noticed, t3.test_most_mutants_are_noticed):
        share, said = judge(check, StudentTests([module()]), mutation)
        assert share == 0.0
        assert said == (
            "test_hash failed each time a line was rewritten without changing what the package does (a.py:3, `0.5` was"
            " written as `(0.25 + 0.25)`). A test that fails on any change of the source does not show that it finds"
            " faults"
        )


@pytest.mark.parametrize(
    "check",
    [
        t12.test_own_tests_pass, t12.test_coverage_of_lines_and_branches, t3.test_mutants_are_noticed,
        t3.test_most_mutants_are_noticed,
    ],
)  # fmt: skip
def test_reports_that_cannot_be_trusted_earn_nothing(check: Callable[[Judge], None]):
    doubt = "test/test_a.py: a test of the grader's that must fail was reported as passed"
    tests = StudentTests([module()], [covered(100)], doubts=[doubt])
    assert judge(check, tests, Mutation(0, 300, faults(40))) == (
        0.0, f"the reports of these tests cannot be trusted: {doubt}",
    )  # fmt: skip


def test_what_was_not_run_is_our_fault():
    for check, tests in ((t12.test_own_tests_pass, None), (t3.test_mutants_are_noticed, StudentTests([module()]))):
        with pytest.raises(Unjudged):
            judge(check, tests)
