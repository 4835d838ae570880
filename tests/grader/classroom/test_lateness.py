"""Late rules: what being late costs, to the second."""

from __future__ import annotations

import datetime as dt
from decimal import Decimal

import pytest

from grader.classroom import lateness
from grader.errors import GraderError

DEADLINE = dt.datetime(2026, 11, 20, 23, 59, tzinfo=dt.UTC)


def after(**time: float) -> dt.datetime:
    return DEADLINE + dt.timedelta(**time)


@pytest.mark.parametrize(
    ("submitted", "days"),
    [(after(), 0), (after(hours=-5), 0), (after(seconds=1), 1), (after(days=1), 1), (after(days=1, seconds=1), 2)],
)
def test_a_day_counts_once_it_has_started(submitted, days):
    assert lateness.parse("10 % per started day").units(submitted, DEADLINE) == days


def test_percent_are_of_the_points_reached_unless_it_says_of_the_maximum():
    reached, maximum = Decimal("80"), Decimal("100")
    assert lateness.parse("10 % per started day").deduction(2, reached, maximum) == 16
    assert lateness.parse("10 % of the maximum per started day").deduction(2, reached, maximum) == 20
    assert lateness.parse("2.5 points per started day").deduction(2, reached, maximum) == 5


def test_no_deduction_takes_more_than_there_is():
    assert lateness.parse("50 points per started day").deduction(3, Decimal("80"), Decimal("100")) == 80


def test_after_the_last_day_nothing_is_accepted():
    rule = lateness.parse("10 % per started day, at most 3 days")
    assert [rule.deduction(days, Decimal("80"), Decimal("100")) for days in (3, 4)] == [24, 80]


def test_grace_costs_nothing_and_then_counts_from_its_end():
    rule = lateness.parse("5 % per started hour, at most 24 hours, 15 minutes of grace")
    assert [rule.units(after(minutes=minutes), DEADLINE) for minutes in (15, 16, 75, 76)] == [0, 1, 1, 2]


def test_times_of_other_zones_are_compared_as_moments():
    berlin = dt.timezone(dt.timedelta(hours=1))
    submitted = dt.datetime(2026, 11, 21, 0, 59, tzinfo=berlin)
    assert lateness.parse("10 % per started day").units(submitted, DEADLINE) == 0


@pytest.mark.parametrize("text", ["10 %", "ten percent per day", "", "-5 % per started day"])
def test_what_is_no_rule_is_refused_with_examples(text):
    with pytest.raises(GraderError, match=r"is not a late rule\. Examples"):
        lateness.parse(text)
