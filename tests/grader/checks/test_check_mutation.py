"""T3: the points for noticed mutants, and the feedback about the others."""

from __future__ import annotations

from types import SimpleNamespace

import pytest
from helpers.judging import Judged, ask, evidence_with

from grader import evidence
from grader.checks.check_mutation import test_most_mutants_are_noticed as most_are_noticed
from grader.checks.check_mutation import test_mutants_are_noticed as are_noticed
from grader.checks.judge import Judge, Unjudged
from grader.evidence import EquivalentMutant, Manifest, Mutant, Mutation, Quality, SourceFile, StudentTests

PASSING = StudentTests([evidence.TestModule("test/test_a.py", False, 4, 4, passed=4)])
HANDED_IN = Quality(Manifest(found=True), files=[SourceFile("ros2_robot_controller/a.py", 90, functions=[[9, 90]])])
CHANGE = ("ros2_robot_controller/a.py", 7, "drive", "comparison", "`<` became `>=` in `d < limit`")
PLACE = "ros2_robot_controller/a.py:7 `<` became `>=` in `d < limit`"
BOTH = (are_noticed, most_are_noticed)


def mutants(noticed: int, unnoticed: int = 0, unreached: int = 0) -> list[Mutant]:
    tried = ["test/test_a.py::test_one", "test/test_a.py::test_two[0.5]", "test/test_a.py::test_three"]
    return [
        *[Mutant(*CHANGE, "noticed", by="test/test_a.py::test_one")] * noticed,
        *[Mutant(*CHANGE, "unnoticed", tried=tried)] * unnoticed,
        *[Mutant(*CHANGE, "unreached")] * unreached,
    ]


def judged(check, mutation: Mutation | None, tests: StudentTests | None = PASSING) -> Judged:
    return ask(check, evidence_with(tests=tests, mutation=mutation, quality=HANDED_IN))


@pytest.mark.parametrize("check", BOTH)
def test_four_of_five_noticed_is_full_marks(check):
    """It says how many, so that nobody takes a sample for the whole."""
    assert judged(check, Mutation(0, mutants(8, 2))) == Judged(1.0, "8 of 10 mutants were noticed, 80 %")


@pytest.mark.parametrize(
    ("noticed", "core", "advanced"),
    [(0, 0.0, 0.0), (4, 0.0, 0.0), (17, 1.0, 0.0), (30, 1.0, 1.0), (40, 1.0, 1.0)],
)
def test_points_go_from_10_to_75_percent_core_first(noticed: int, core: float, advanced: float):
    """10 % of 40 mutants are 4, 42.5 % are 17, 75 % are 30."""
    mutation = Mutation(0, mutants(noticed, 40 - noticed))
    assert judged(are_noticed, mutation).share == pytest.approx(core)
    assert judged(most_are_noticed, mutation).share == pytest.approx(advanced)


def test_an_unnoticed_mutant_is_reported_with_its_place_change_and_passing_tests():
    assert judged(are_noticed, Mutation(0, mutants(1, 1, 1))).seen.splitlines() == [
        "1 of 3 mutants were noticed, 33.3 %",
        f"{PLACE}: test_one, test_two[0.5] and 1 more passed all the same",
        f"{PLACE}: no test reaches this line",
    ]


def test_a_long_list_ends_with_how_many_more():
    said = judged(are_noticed, Mutation(0, mutants(0, 30, 10))).seen
    assert len(said.splitlines()) == 10
    assert said.endswith("and 32 more")


def test_mutants_that_were_not_tried_do_not_count():
    cut = [Mutant(*CHANGE, "not tried")] * 20
    note = "20 of 40 faults were not tried: the budget of 20 s was used up"
    said = judged(most_are_noticed, Mutation(0, [*mutants(2, 18), *cut], note=note)).seen
    assert said.startswith(f"2 of 20 mutants were noticed, 10 %; {note}\n")


@pytest.mark.parametrize("check", BOTH)
def test_a_suite_that_fails_on_equivalent_mutants_gets_nothing_and_says_why(check):
    equivalent = [EquivalentMutant("a.py", 3, "`0.5` was written as `(0.25 + 0.25)`", 4, ["test/test_a.py::test_hash"])]
    said = judged(check, Mutation(0, mutants(40), equivalent, convicted=["test/test_a.py::test_hash"]))
    assert said.share == 0.0
    assert said.seen == (
        "test_hash failed each time a line was rewritten without changing what the package does (a.py:3, `0.5` was"
        " written as `(0.25 + 0.25)`). A test that fails on any change of the source does not show that it finds"
        " mistakes"
    )


def test_mutants_of_files_of_which_nothing_ran_in_a_node_do_not_count(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(Judge, "measured", lambda _: SimpleNamespace(covers=lambda path, _line: path == CHANGE[0]))
    padding = [Mutant("ros2_robot_controller/pad.py", *CHANGE[1:], "noticed")] * 30
    said = judged(are_noticed, Mutation(0, [*mutants(1, 9), *padding]))
    assert said.seen.startswith("1 of 10 mutants were noticed, 10 %")


def test_without_a_passing_test_nothing_could_be_noticed():
    said = judged(are_noticed, Mutation(0), StudentTests())
    assert not said.reached
    assert said.seen == "none of the package's own tests passed, so none could notice anything (T1)"


def test_mutants_that_were_not_made_are_an_error_of_the_grader():
    with pytest.raises(Unjudged):
        judged(are_noticed, None)
