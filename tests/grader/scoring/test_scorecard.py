"""Points: what a check earns, and what becomes of it when something is missing, double or ours."""

import math

import pytest

from grader.scoring.rubric import Check, Criterion, Requirement, Rubric
from grader.scoring.scorecard import CheckResult, Outcome, hundredths, level, score

LEVELS = {"A": "all", "B": "most", "C": "some", "D": "little"}


def rubric(*requirements):
    criterion = Criterion("f", "F", sum(r.points for r in requirements), LEVELS, requirements)
    return Rubric("A rubric", "1", (criterion,))


def requirement(name, *points):
    checks = tuple(Check(f"test_{name}::test_{i}", p, "core") for i, p in enumerate(points))
    return Requirement(name, "f", sum(points) or 1.0, "It works.", "01_a#B", checks)


def passed(name, index=0):
    return CheckResult(f"test_{name}::test_{index}", Outcome.PASSED, 1.0)


def result(outcome, fraction, name="F1", index=0):
    return CheckResult(f"test_{name}::test_{index}", outcome, fraction)


F1 = requirement("F1", 3.0, 1.0)
F2 = requirement("F2", 2.0)
LATER = requirement("F3")


def test_everything_passed_is_full_marks():
    card = score(rubric(F1, F2), [passed("F1"), passed("F1", 1), passed("F2")])
    assert (card.points, card.max, card.complete) == (6.0, 6.0, True)
    assert [r.outcome for r in card.requirements] == [Outcome.PASSED, Outcome.PASSED]
    assert (card.criteria[0].level, card.criteria[0].words) == ("A", "all")


def test_each_check_costs_its_own_points_and_no_others():
    card = score(rubric(F1, F2), [result(Outcome.FAILED, 0.0), passed("F1", 1), passed("F2")])
    assert [(r.points, r.outcome) for r in card.requirements] == [(1.0, Outcome.PARTIAL), (2.0, Outcome.PASSED)]
    assert [r.id for r in card.requirements[0].lost] == ["test_F1::test_0"]


@pytest.mark.parametrize(
    ("fractions", "points"),
    [((0.98, 1.0), 4.0), ((0.98, 0.96), 3.9), ((1.0, 0.91), 4.0), ((1.0, 0.9), 3.9), ((0.96, 0.5), 3.38)],
)
def test_a_requirement_that_would_lose_less_than_a_tenth_of_a_point_loses_nothing(fractions, points):
    """Losses of its checks count together."""
    partial = [result(Outcome.PARTIAL, fraction, index=index) for index, fraction in enumerate(fractions)]
    (scored,) = score(rubric(F1), partial).requirements
    assert scored.points == points
    assert (scored.outcome is Outcome.PASSED) == (points == 4.0)


def test_points_carry_no_dust_of_binary_fractions():
    three = requirement("F1", 0.1, 0.1, 0.1)
    assert score(rubric(three), [passed("F1", i) for i in range(3)]).points == 0.3


@pytest.mark.parametrize(
    ("fraction", "points", "outcome"),
    [
        (0.35, 0.7, Outcome.PARTIAL), (1.5, 2.0, Outcome.PASSED), (math.inf, 2.0, Outcome.PASSED),
        (-1.0, 0.0, Outcome.FAILED), (-math.inf, 0.0, Outcome.FAILED), (math.nan, 0.0, Outcome.FAILED),
    ],
)  # fmt: skip
def test_a_fraction_earns_its_share_and_no_more_than_all_and_no_less_than_nothing(fraction, points, outcome):
    card = score(rubric(F2), [result(Outcome.PARTIAL, fraction, "F2")])
    assert (card.points, card.requirements[0].outcome) == (points, outcome)


@pytest.mark.parametrize("times", [0, 2])
def test_a_missing_or_double_result_is_an_error_of_ours_and_no_pass(times):
    card = score(rubric(F1, F2), [passed("F1"), passed("F1", 1), *[passed("F2")] * times])
    f2 = card.requirements[1]
    assert (f2.outcome, f2.points, f2.max) == (Outcome.ERROR, 0.0, 0.0)
    assert f2.results[0].seen == f"the check test_F2::test_0 gave {times} results instead of one"
    assert (card.complete, card.points, card.max) == (False, 4.0, 4.0)


def test_a_result_nobody_asked_for_is_ignored():
    card = score(rubric(F2), [passed("F2"), passed("F9"), result(Outcome.ERROR, 0.0, "F9", 1)])
    assert (card.points, card.max, card.complete) == (2.0, 2.0, True)


def test_an_error_costs_no_points_but_takes_its_own_out_of_the_sum():
    card = score(rubric(F1), [result(Outcome.ERROR, 0.0), passed("F1", 1)])
    f1 = card.requirements[0]
    assert (f1.points, f1.max, f1.outcome) == (1.0, 1.0, Outcome.ERROR)
    assert not card.complete
    assert score(rubric(F2), [result(Outcome.ERROR, 1.0, "F2")]).points == 0.0


def test_what_only_waited_is_not_reached_and_what_also_failed_is_failed():
    waited = [result(Outcome.NOT_REACHED, 0.0), result(Outcome.NOT_REACHED, 0.0, index=1)]
    assert score(rubric(F1), waited).requirements[0].outcome is Outcome.NOT_REACHED
    also_failed = [result(Outcome.FAILED, 0.0), result(Outcome.NOT_REACHED, 0.0, index=1)]
    assert score(rubric(F1), also_failed).requirements[0].outcome is Outcome.FAILED
    assert score(rubric(F1), waited).complete, "the student's fault, unlike an error"


def test_a_requirement_without_checks_is_not_graded_and_counts_nowhere():
    card = score(rubric(F2, LATER), [passed("F2")])
    assert card.requirements[1].outcome is Outcome.NOT_GRADED
    assert (card.points, card.max, card.complete) == (2.0, 2.0, True)
    alone = score(rubric(LATER), []).criteria[0]
    assert (alone.level, alone.words, alone.max) == ("", "", 0.0)


@pytest.mark.parametrize(
    ("points", "letter"),
    [(100, "A"), (90, "A"), (89.99, "B"), (75, "B"), (74.99, "C"), (60, "C"), (59.99, "D"), (0, "D")],
)
def test_levels_begin_at_their_boundary(points, letter):
    assert level(points, 100) == letter


def test_a_level_is_not_missed_by_a_rounding_error():
    assert level(0.1 + 0.2 + 0.6, 1.0) == "A"
    assert level(0.9 * 23, 23) == "A"


@pytest.mark.parametrize(("points", "shown"), [(2.675, 2.68), (2.005, 2.01), (1.004999, 1.0), (0.1 + 0.2, 0.3)])
def test_hundredths_are_rounded_half_up_whatever_the_binary_digits(points, shown):
    assert hundredths(points) == shown
