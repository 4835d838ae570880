"""Late rules, such as "10 % per started day, at most 3 days". Pure: times in, deductions out."""

from __future__ import annotations

import datetime as dt
import math
import re
from dataclasses import dataclass
from decimal import Decimal

from grader.errors import GraderError

_UNITS = {"day": 86_400, "hour": 3_600}
_RULE = re.compile(
    r"(?P<amount>\d+(?:\.\d+)?)\s*(?P<kind>%|percent|points?)(?P<whole>\s+of\s+the\s+maximum)?"
    r"\s+per\s+(?:started\s+)?(?P<unit>day|hour)"
    r"(?:,\s*at\s+most\s+(?P<most>\d+)\s*(?:days?|hours?))?"
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
        most: after so many units a submission is not accepted, None for no end.
        grace_s: seconds after the deadline that cost nothing.
    """

    amount: Decimal
    percent: bool = True
    of_maximum: bool = False
    unit_s: int = _UNITS["day"]
    most: int | None = None
    grace_s: int = 0

    def units(self, submitted: dt.datetime, deadline: dt.datetime) -> int:
        """Return the started units by which a submission is late, 0 if it is in time."""
        late_s = (submitted - deadline).total_seconds() - self.grace_s
        return max(0, math.ceil(late_s / self.unit_s))

    def too_late(self, units: int) -> bool:
        """Return whether a submission that is `units` late is not accepted."""
        return self.most is not None and units > self.most

    def deduction(self, units: int, points: Decimal, maximum: Decimal) -> Decimal:
        """Return the points that are taken from `points`, never more than there are."""
        if self.too_late(units):
            return points
        base = maximum if self.of_maximum else points
        taken = units * (base * self.amount / 100 if self.percent else self.amount)
        return min(points, taken)

    @property
    def unit(self) -> str:
        """Return the name of a unit."""
        return next(name for name, seconds in _UNITS.items() if seconds == self.unit_s)


def parse(text: str) -> LateRule:
    """Return the rule that `text` describes.

    Raises:
        GraderError: it describes none.
    """
    found = _RULE.fullmatch(text.strip())
    if found is None:
        raise GraderError(
            f'"{text}" is not a late rule. Examples: "10 % per started day, at most 3 days"; '
            '"5 % of the maximum per started hour, at most 24 hours, 15 minutes of grace"; "2 points per started day".'
        )
    return LateRule(
        amount=Decimal(found["amount"]),
        percent=not found["kind"].lower().startswith("point"),
        of_maximum=found["whole"] is not None,
        unit_s=_UNITS[found["unit"].lower()],
        most=int(found["most"]) if found["most"] else None,
        grace_s=60 * int(found["grace"] or 0),
    )
