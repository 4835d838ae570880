"""Late rules, such as "10 % per started day, at most 3 days". Pure: times in, deductions out."""

from __future__ import annotations

import datetime as dt
import math
import re
from dataclasses import dataclass
from decimal import Decimal

from grader.errors import GraderError

_UNITS = {"day": 86_400, "hour": 3_600}
_EXAMPLE = Decimal("0.8")  # of the maximum: a share at which "of the maximum" makes a difference
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
        unit_s: the length of a unit in seconds.
        most_s: seconds after which a submission is not accepted, None for no end; counted from the end of the grace.
        grace_s: seconds after the deadline that cost nothing.
    """

    amount: Decimal
    percent: bool = True
    of_maximum: bool = False
    unit_s: int = _UNITS["day"]
    most_s: int | None = None
    grace_s: int = 0

    def units(self, submitted: dt.datetime, deadline: dt.datetime) -> int:
        """Return the started units by which a submission is late, 0 if it is in time."""
        return max(0, math.ceil(self._late_s(submitted, deadline) / self.unit_s))

    def too_late(self, submitted: dt.datetime, deadline: dt.datetime) -> bool:
        """Return whether a submission is not accepted any more."""
        return self.most_s is not None and self._late_s(submitted, deadline) > self.most_s

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
        name = next(name for name, seconds in _UNITS.items() if seconds == self.unit_s)
        return f"{units} started {name}{'' if units == 1 else 's'}"

    def examples(self, deadline: dt.datetime, maximum: Decimal) -> list[str]:
        """Return three sentences that show what the rule does to 80 % of `maximum`, computed by the rule itself.

        The first hand-in is a minute late; the others are at the end of what is accepted and a minute after it, or one
        and three units late if there is no end.
        """
        minute = 60
        ends = (self.unit_s, 3 * self.unit_s) if self.most_s is None else (self.most_s, self.most_s + minute)
        points = (maximum * _EXAMPLE).quantize(Decimal("0.01"))
        return [self._example(deadline, self.grace_s + seconds, points, maximum) for seconds in (minute, *ends)]

    def _example(self, deadline: dt.datetime, late_s: int, points: Decimal, maximum: Decimal) -> str:
        submitted = deadline + dt.timedelta(seconds=late_s)
        taken = self.deduction(submitted, deadline, points, maximum).quantize(Decimal("0.01"))
        counted = "too late" if self.too_late(submitted, deadline) else self.counted(self.units(submitted, deadline))
        after = ", ".join(
            f"{number} {name}{'' if number == 1 else 's'}"
            for number, name in ((late_s // 3600, "hour"), (late_s % 3600 // 60, "minute"))
            if number
        )
        return (
            f"{submitted:%Y-%m-%d %H:%M}, {after} after the deadline: {counted}; "
            f"of {points} points {taken} are deducted, {points - taken} are left"
        )

    def _late_s(self, submitted: dt.datetime, deadline: dt.datetime) -> float:
        return (submitted - deadline).total_seconds() - self.grace_s


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
        unit_s=_UNITS[found["unit"].lower()],
        most_s=int(found["most"]) * _UNITS[found["most_unit"].lower()] if found["most"] else None,
        grace_s=60 * int(found["grace"] or 0),
    )
