"""Late rules: what being late costs, to the second."""

from __future__ import annotations

import datetime as dt
import time
from decimal import Decimal

import pytest

from grader.classroom import times
from grader.errors import GraderError

DEADLINE = dt.datetime(2026, 11, 20, 23, 59, tzinfo=dt.UTC)


def after(**time: float) -> dt.datetime:
    return DEADLINE + dt.timedelta(**time)


@pytest.mark.parametrize(
    ("submitted", "days"),
    [(after(), 0), (after(hours=-5), 0), (after(seconds=1), 1), (after(days=1), 1), (after(days=1, seconds=1), 2)],
)
def test_a_day_counts_once_it_has_started(submitted, days):
    assert times.late_rule("10 % per started day").days(submitted, DEADLINE) == days


def test_percent_are_of_the_points_reached_unless_it_says_of_the_maximum():
    reached, maximum = Decimal("80"), Decimal("100")
    for text, points in (
        ("10 % per started day", 16),
        ("10 % of the maximum per started day", 20),
        ("2.5 points per started day", 5),
    ):
        assert times.late_rule(text).deduction(after(days=2), DEADLINE, reached, maximum) == points


def test_after_the_last_day_nothing_is_accepted():
    rule = times.late_rule("10 % per started day, at most 3 days")
    taken = [rule.deduction(after(days=days), DEADLINE, Decimal("80"), Decimal("100")) for days in (3, 4)]
    assert taken == [24, 80]


@pytest.mark.parametrize("text", ["10 %", "ten percent per day", "", "-5 % per started day", "1 % per started hour"])
def test_what_is_no_rule_is_refused_with_examples(text):
    with pytest.raises(GraderError, match=r"is not a late rule\. Examples"):
        times.late_rule(text)


@pytest.fixture
def berlin(monkeypatch):
    """The clocks go back on 25 October 2026 at three, and forward on 28 March 2027 at two."""
    monkeypatch.setenv("TZ", "Europe/Berlin")
    time.tzset()
    yield
    monkeypatch.undo()
    time.tzset()


@pytest.mark.parametrize(
    ("deadline", "submitted", "days"),
    [
        ("2026-10-24T23:59", "2026-10-25T23:30", 1),
        ("2026-10-24T23:59", "2026-10-25T23:59", 1),
        ("2026-10-24T23:59", "2026-10-26T00:00", 2),
        ("2027-03-27T23:59", "2027-03-28T23:59", 1),
        ("2027-03-27T23:59", "2027-03-29T00:00", 2),
        ("2026-10-24T23:59", "2027-03-28T23:30", 155),
    ],
)
def test_days_are_those_of_the_calendar_also_when_the_clocks_are_changed(berlin, deadline, submitted, days):
    """Half an hour before the end of the first day, over the night with 25 hours, were two days."""
    rule = times.late_rule("10 % per started day, at most 3 days")
    due, when = times.local_time(deadline), times.local_time(submitted)
    assert rule.days(when, due) == days
    assert rule.too_late(when, due) is (days > 3)
