"""Late rules, such as "10 % per started day, at most 3 days". Pure: times in, deductions out.

A day is one of the calendar of this machine's time zone: it ends at the deadline's time of the next day, also in the
nights in which the clocks are changed. An hour has 60 minutes.
"""

from __future__ import annotations

import datetime as dt
import re
from dataclasses import dataclass
from decimal import Decimal

from grader.errors import GraderError

_DAY, _HOUR = "day", "hour"
MARKED = "marked as late by the platform, which does not say by how much"
_RULE = re.compile(
    r"(?P<amount>\d+(?:\.\d+)?)\s*(?P<kind>%|percent|points?)(?P<whole>\s+of\s+the\s+maximum)?"
    r"\s+per\s+(?:started\s+)?(?P<unit>day|hour)"
    r"(?:,\s*at\s+most\s+(?P<most>\d+)\s*(?P<most_unit>day|hour)s?)?"
    r"(?:,\s*(?P<grace>\d+)\s+minutes?\s+of\s+grace)?",
    re.IGNORECASE,
)


@dataclass(frozen=True)
class LateRule:
    """What being late costs.

    Attributes:
        amount: percent or points for each started unit.
        percent: whether `amount` is in percent, else it is in points.
        of_maximum: percent of the points that can be reached, instead of those that were.
        unit: "day" or "hour".
        most: how many days or hours after the deadline, and its grace, a submission is accepted; None for no end.
        grace_s: seconds after the deadline that cost nothing.
    """

    amount: Decimal
    percent: bool = True
    of_maximum: bool = False
    unit: str = _DAY
    most: tuple[int, str] | None = None
    grace_s: int = 0

    def units(self, submitted: dt.datetime, deadline: dt.datetime) -> int:
        """Return the started units by which a submission is late, 0 if it is in time."""
        count = max(0, (submitted - deadline) // _length(self.unit) - 1)  # days differ in length by an hour or two
        while submitted > self._end(deadline, count, self.unit):
            count += 1
        return count

    def too_late(self, submitted: dt.datetime, deadline: dt.datetime) -> bool:
        """Return whether a submission is not accepted any more."""
        return self.most is not None and submitted > self._end(deadline, *self.most)

    def deduction(
        self, submitted: dt.datetime, deadline: dt.datetime, points: Decimal, maximum: Decimal
    ) -> Decimal:  # fmt: skip
        """Return the points that are deducted from `points`, never more than there are."""
        if self.too_late(submitted, deadline):
            return points
        units = self.units(submitted, deadline)
        base = maximum if self.of_maximum else points
        return min(points, units * (base * self.amount / 100 if self.percent else self.amount))

    def counted(self, units: int) -> str:
        """Return a number of units in words, such as "2 started days"."""
        return f"{units} started {self.unit}{'' if units == 1 else 's'}"

    def _end(self, deadline: dt.datetime, count: int, unit: str) -> dt.datetime:
        """Return when so many units after the deadline, and the grace, are over."""
        if unit == _HOUR or not count:
            end = deadline + count * _length(unit)
        else:
            wall_clock = deadline.astimezone().replace(tzinfo=None) + dt.timedelta(days=count)
            end = max(wall_clock.replace(fold=fold).astimezone(deadline.tzinfo) for fold in (0, 1))
        return end + dt.timedelta(seconds=self.grace_s)


def _length(unit: str) -> dt.timedelta:
    return dt.timedelta(**{f"{unit}s": 1})


def clock(seconds: float) -> str:
    """Return a duration as hours, minutes and seconds."""
    minutes = int(seconds) // 60
    return f"{minutes // 60}:{minutes % 60:02}:{int(seconds) % 60:02}"


def late_by(submitted: dt.datetime, deadline: dt.datetime, rule: LateRule | None) -> str:
    """Return by how much a submission is late, such as "34:01:00, 2 started days"; "" if it is in time."""
    if submitted <= deadline:
        return ""
    units = [rule.counted(rule.units(submitted, deadline))] if rule else []
    too_late = ["too late to be accepted"] if rule and rule.too_late(submitted, deadline) else []
    return ", ".join([clock((submitted - deadline).total_seconds()), *units, *too_late])


def parse(text: str) -> LateRule:
    """Return the rule that `text` describes.

    Raises:
        GraderError: it describes none.
    """
    found = _RULE.fullmatch(text.strip())
    if found is None:
        raise GraderError(
            f'"{text}" is not a late rule. Examples: "10 % per started day, at most 3 days"; '
            '"5 % of the maximum per started hour, at most 2 days, 15 minutes of grace"; "2 points per started day".'
        )
    return LateRule(
        amount=Decimal(found["amount"]),
        percent=not found["kind"].lower().startswith("point"),
        of_maximum=found["whole"] is not None,
        unit=found["unit"].lower(),
        most=(int(found["most"]), found["most_unit"].lower()) if found["most"] else None,
        grace_s=60 * int(found["grace"] or 0),
    )
