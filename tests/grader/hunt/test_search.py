"""A hunt over cases whose trials a function makes: what is found, made smaller, and left out."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from typing import Any

import pytest
from helpers.hunting import SLOW, WAITS, driven, running, waiting

from grader.errors import SubmissionError
from grader.evidence import Kind, Reason, Trial
from grader.hunt import search
from grader.hunt.search import Finding, Hunted
from grader.trials.case import Case


def hunt(make: Callable[[Case], Trial], threads: int = 2, **options: Any) -> tuple[Hunted, list[Case]]:
    with running(make, threads) as (runner, ran):
        return search.hunt(runner, WAITS, [SLOW], **{"cases": 60, "seed": 7, **options}), ran


def waits_long(case: Case) -> bool:
    return any(step.to >= 3.0 for step in case.steps)


def fast_after_a_long_wait(case: Case) -> Trial:
    return driven(1.0 if waits_long(case) else 0.1)


def slow(_case: Case) -> Trial:
    return driven(0.1)


def fails_once(unsteady: Callable[[Case], bool], always: Callable[[Case], bool]) -> Callable[[Case], Trial]:
    """Return what makes a trial that is fast always, or only when the case is run for the first time."""
    times = Counter[Case]()

    def make(case: Case) -> Trial:
        times[case] += 1
        return driven(1.0 if always(case) or (unsteady(case) and times[case] == 1) else 0.1)

    return make


def test_the_same_seed_tries_the_same_cases_in_order():
    found, ran = hunt(slow, threads=1)
    assert found == Hunted(60, 7)
    assert ran == hunt(slow, threads=1)[1] == search.listed(WAITS, 60, 7)
    assert ran != search.listed(WAITS, 60, 8)


@pytest.mark.parametrize("threads", [1, 2, 5])
def test_the_first_case_in_order_that_fails_is_found_however_many_run_at_once(threads: int):
    listed = search.listed(WAITS, 60, 7)
    first = next(number for number, case in enumerate(listed, 1) if waits_long(case))
    told: list[Finding] = []
    found, _ = hunt(fast_after_a_long_wait, threads, found=told.append)
    assert found.finding is not None
    assert found.cases == found.finding.after == first
    assert told[0].case == listed[first - 1]


def test_a_found_case_is_made_as_small_as_it_can_be():
    found, ran = hunt(fast_after_a_long_wait)
    assert found.finding is not None
    assert found.finding.case == waiting(30)
    assert found.finding.broken.seen == "1 m/s at 0.5 s"
    assert ran.count(waiting(30)) == 1 + search.AGAIN


def test_no_more_cases_than_allowed_are_run_to_make_it_smaller():
    found, ran = hunt(fast_after_a_long_wait, shrinks=4)
    assert found.finding is not None
    further = {*ran} - {*search.listed(WAITS, 60, 7)}
    assert len(further) <= 4
    assert fast_after_a_long_wait(found.finding.case).commands[0].v == 1.0


def test_a_case_that_fails_only_once_is_listed_and_not_shown():
    found, _ = hunt(fails_once(waits_long, lambda _: False))
    assert found.finding is None
    assert found.cases == 60
    assert found.unsteady
    assert all(waits_long(finding.case) for finding in found.unsteady)


def test_what_is_found_after_an_unsteady_case_is_made_smaller_itself():
    """Hypothesis meets the unsteady case first when it is asked again; it must not take that for the finding."""

    def three_or_more(case: Case) -> bool:
        return len(case.steps) >= 3 and waits_long(case)

    found, _ = hunt(fails_once(lambda case: len(case.steps) < 3, three_or_more))
    assert found.unsteady
    assert found.finding is not None
    assert three_or_more(found.finding.case)
    assert len(found.finding.case.steps) == 3


def test_a_smaller_case_that_fails_only_once_is_not_shown_in_place_of_a_larger_one():
    def two_or_more(case: Case) -> bool:
        return len(case.steps) >= 2 and waits_long(case)

    unsteady = waits_long  # of which those with one step are the smallest
    found, _ = hunt(fails_once(unsteady, two_or_more))
    assert found.finding is not None
    assert two_or_more(found.finding.case)


def test_no_case_is_begun_when_the_time_is_over():
    goes_on = iter([True] * 5 + [False])
    found, ran = hunt(slow, goes_on=lambda: next(goes_on))
    assert found == Hunted(5, 7)
    assert len(ran) == 5


def test_a_finding_is_told_before_it_is_made_smaller_so_that_ctrl_c_keeps_it():
    told: list[Finding] = []

    def interrupted_later(case: Case) -> Trial:
        if told:
            raise KeyboardInterrupt
        return fast_after_a_long_wait(case)

    with pytest.raises(KeyboardInterrupt):
        hunt(interrupted_later, found=told.append)
    assert len(told) == 1


def test_a_case_with_nan_is_known_when_it_comes_again():
    nans = [Case.of({"node": "n", "steps": [{"call": {"service": "s", "speed": float("nan")}}]}) for _ in range(2)]
    with running(slow) as (runner, ran):
        for _ in range(2):
            assert len(list(runner.run(nans[:1]))) == 1
            nans.reverse()
    assert len(ran) == 1


def test_a_node_that_waits_away_the_time_of_all_cases_ends_the_hunt_and_is_named():
    waited = Reason(Kind.WAITED, seconds=60.0)
    with pytest.raises(
        SubmissionError, match=r"The hunt has ended: the trial was not run: .* the node had waited 60 s"
    ):
        hunt(lambda _: driven(0.0, ended=waited))
