"""When submissions were handed in, where the export does not say, and what late ones cost.

A grading worksheet of Moodle has the time of each participant's submission, Canvas's list of an assignment's
submissions (JSON of its API) that of each account; any CSV with a column `submitted` serves too.

A late rule is such as "10 % per started day, at most 3 days". A day is one of the calendar of this machine's time zone:
it ends at the deadline's time of the next day, also in the nights in which the clocks are changed. An hour has 60
minutes.
"""

from __future__ import annotations

import datetime as dt
import json
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from decimal import Decimal
from pathlib import Path

from grader.classroom import roster
from grader.classroom.class_folder import Doubt, DoubtKind, Entry
from grader.classroom.identity import Claim, identify
from grader.classroom.roster import IDENTITY, Person
from grader.errors import GraderError
from grader.words import counted, some

_NONE = ("", "-")


@dataclass(frozen=True)
class HandInTime:
    """That one person handed in, and when: None if `text`, which the list says, cannot be read or says no time."""

    claims: tuple[Claim, ...]
    when: dt.datetime | None
    text: str


def load(path: Path) -> tuple[HandInTime, ...]:
    """Return the times in a list of submissions or in a roster, none if it has no column of them."""
    return tuple(_of_canvas(path) if path.suffix.lower() == ".json" else _of_table(path))


def added(entries: Sequence[Entry], people: Sequence[Person], times: Sequence[HandInTime]) -> list[Entry]:
    """Return the entries, those without a time with the latest time of whoever handed them in."""
    everyone = people or tuple(dict.fromkeys(person for entry in entries for person in entry.people))
    known: dict[Person, list[dt.datetime]] = {}
    for time in times:
        for person in identify(time.claims, everyone).people:
            if time.when is not None:
                known.setdefault(person, []).append(time.when)
    return [entry if entry.submitted else replace(entry, submitted=_latest(entry, known)) for entry in entries]


def doubts(entries: Sequence[Entry], times: Sequence[HandInTime], layout: str) -> Iterator[Doubt]:
    """Yield a doubt about the submissions without a time, and one about each time that cannot be read."""
    without = sorted(entry.label for entry in entries if entry.submitted is None)
    if without:
        names = some(without)
        yield Doubt(
            DoubtKind.NO_TIME,
            layout,
            f"{len(without)} of {len(entries)} submissions have no time, so nothing is deducted for lateness: {names}.",
            _SOURCES.get(layout, "Give their times with --times, or as `submitted:` in overrides.yaml."),
        )
    for time in times:
        if time.when is None and time.text:
            label = ", ".join(claim.text for claim in time.claims)
            what = f'The time "{time.text}" of {label} cannot be read.'
            yield Doubt(DoubtKind.NO_TIME, label, what, "Write it as 2026-11-20T23:59 into a CSV for --times.")


_SOURCES = {
    "moodle": "Download the grading worksheet of the assignment, and give it with --roster or --times.",
    "canvas": "Save the list of the assignment's submissions as JSON, and give it with --times "
    "(docs/classes.md says how).",
}


def _latest(entry: Entry, known: dict[Person, list[dt.datetime]]) -> dt.datetime | None:
    """Return the latest time of those who were matched themselves; of their team only if they have none."""
    own = {who for who, claim in zip(entry.people, entry.matched, strict=True) if claim.kind != "team"}
    for people in (own, set(entry.people)):
        if times := [time for who in people for time in known.get(who, ())]:
            return max(times)
    return None


def _of_table(path: Path) -> Iterator[HandInTime]:
    for _, person, text, status in roster.rows(path):
        claims = tuple(
            Claim(kind, value, person.lms if kind == "lms_id" else "")
            for kind in (*IDENTITY, "name")
            if (value := getattr(person, kind))
        )
        state = status.casefold()
        if text not in _NONE and not state.startswith(roster.NOT_HANDED_IN):
            yield HandInTime(claims, local_time(text) or roster.worksheet_time(text), text)
        elif state.startswith(roster.HANDED_IN):
            yield HandInTime(claims, None, "")


def _of_canvas(path: Path) -> Iterator[HandInTime]:
    try:
        for submission in json.loads(path.read_text(encoding="utf-8-sig")):
            if submission["submitted_at"]:
                text = str(submission["submitted_at"])
                yield HandInTime((Claim("lms_id", str(submission["user_id"]), "canvas"),), local_time(text), text)
    except (OSError, ValueError, TypeError, KeyError) as error:
        raise GraderError(
            f"{path} is not a list of submissions as Canvas's API writes it ({error!r}). Save it once more."
        ) from error


def local_time(text: str) -> dt.datetime | None:
    """Return a time of ISO 8601, without a zone the local one's (the earlier, of two); None for other text."""
    try:
        time = dt.datetime.fromisoformat(text)
    except ValueError:
        return None
    return time if time.tzinfo else time.astimezone()


MARKED = "marked as late by the platform, which does not say by how much"
_RULE = re.compile(
    r"(?P<amount>\d+(?:\.\d+)?)\s*(?P<kind>%|percent|points?)(?P<whole>\s+of\s+the\s+maximum)?"
    r"\s+per\s+(?:started\s+)?day(?:,\s*at\s+most\s+(?P<most>\d+)\s*days?)?",
    re.IGNORECASE,
)


@dataclass(frozen=True)
class LateRule:
    """What being late costs.

    Attributes:
        amount: percent or points for each started day.
        percent: whether `amount` is in percent, else it is in points.
        of_maximum: percent of the points that can be reached, instead of those that were.
        most: how many days after the deadline a submission is accepted; None for no end.
    """

    amount: Decimal
    percent: bool = True
    of_maximum: bool = False
    most: int | None = None

    def days(self, submitted: dt.datetime, deadline: dt.datetime) -> int:
        """Return the started days by which a submission is late, 0 if it is in time."""
        count = max(0, (submitted - deadline).days - 1)  # days differ in length by an hour or two
        while submitted > _end(deadline, count):
            count += 1
        return count

    def too_late(self, submitted: dt.datetime, deadline: dt.datetime) -> bool:
        """Return whether a submission is not accepted any more."""
        return self.most is not None and submitted > _end(deadline, self.most)

    def deduction(
        self, submitted: dt.datetime, deadline: dt.datetime, points: Decimal, maximum: Decimal
    ) -> Decimal:  # fmt: skip
        """Return the points that are deducted from `points`, never more than there are."""
        if self.too_late(submitted, deadline):
            return points
        days = self.days(submitted, deadline)
        base = maximum if self.of_maximum else points
        return min(points, days * (base * self.amount / 100 if self.percent else self.amount))


def _end(deadline: dt.datetime, days: int) -> dt.datetime:
    """Return the deadline's time so many days later by the calendar."""
    wall_clock = deadline.astimezone().replace(tzinfo=None) + dt.timedelta(days=days)
    return max(wall_clock.replace(fold=fold).astimezone(deadline.tzinfo) for fold in (0, 1)) if days else deadline


def clock(seconds: float) -> str:
    """Return a duration as hours, minutes and seconds."""
    minutes = int(seconds) // 60
    return f"{minutes // 60}:{minutes % 60:02}:{int(seconds) % 60:02}"


def late_by(submitted: dt.datetime, deadline: dt.datetime, rule: LateRule | None) -> str:
    """Return by how much a submission is late, such as "34:01:00, 2 started days"; "" if it is in time."""
    if submitted <= deadline:
        return ""
    days = [counted(rule.days(submitted, deadline), "started day")] if rule else []
    too_late = ["too late to be accepted"] if rule and rule.too_late(submitted, deadline) else []
    return ", ".join([clock((submitted - deadline).total_seconds()), *days, *too_late])


def late_rule(text: str) -> LateRule:
    """Return the rule that `text` describes.

    Raises:
        GraderError: it describes none.
    """
    found = _RULE.fullmatch(text.strip())
    if found is None:
        raise GraderError(
            f'"{text}" is not a late rule. Examples: "10 % per started day, at most 3 days"; '
            '"5 % of the maximum per started day"; "2 points per started day".'
        )
    return LateRule(
        amount=Decimal(found["amount"]),
        percent=not found["kind"].lower().startswith("point"),
        of_maximum=found["whole"] is not None,
        most=int(found["most"]) if found["most"] else None,
    )
