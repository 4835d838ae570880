"""index.html: a class at a glance, as one self-contained page."""

from __future__ import annotations

import base64
import hashlib
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path
from statistics import mean, median
from typing import Any

from grader.classroom.class_folder import OVERVIEW, ClassFacts, ClassFolder, Record, Status
from grader.classroom.gradebook import NOTHING, Gradebook, Row, State
from grader.host.atomic import write_atomically
from grader.sanitize import lines, one_line
from grader.scoring.scorecard import level

HERE = Path(__file__).parent
_BARS = 10
_WORST = 10
_SLOWEST = 5
_SEEN = 160


@dataclass(frozen=True)
class Line:
    """One submission in the table: `share` of the points, and of each requirement's, in percent or None."""

    row: Row
    people: str
    remarks: str
    criteria: tuple[Decimal, ...]
    cells: tuple[tuple[str, int | None], ...]
    level: str
    seconds: float
    linked: bool


@dataclass(frozen=True)
class Bar:
    """One bar of the histogram: how many reached at least `low` and less than `high` points."""

    low: int
    high: int
    count: int
    height: float


@dataclass(frozen=True)
class Hard:
    """A requirement on which a class lost points: the mean share reached in percent, and what was seen most often."""

    id: str
    title: str
    share: int
    failed: int
    seen: str
    seen_count: int


@dataclass(frozen=True)
class Overview:
    """All that the page shows."""

    facts: ClassFacts
    lines: tuple[Line, ...]
    bars: tuple[Bar, ...]
    hard: tuple[Hard, ...]
    states: tuple[tuple[str, int], ...]
    flags: tuple[tuple[str, str, str], ...]
    errors: tuple[Record, ...]
    slowest: tuple[Record, ...]
    totals: tuple[Decimal, ...]
    missing: tuple[str, ...]

    @property
    def mean(self) -> float:
        """Return the mean of the totals, 0 without any."""
        return float(mean(self.totals)) if self.totals else 0.0

    @property
    def median(self) -> float:
        """Return the median of the totals, 0 without any."""
        return float(median(self.totals)) if self.totals else 0.0


def write(folder: ClassFolder, book: Gradebook) -> Path:
    """Write the page into the class folder and return its path."""
    path = folder.path / OVERVIEW
    write_atomically(path, render(summarise(folder, book), book))
    return path


def summarise(folder: ClassFolder, book: Gradebook) -> Overview:
    """Return what there is to say about a class. One row stands for its team; the people are named in it."""
    facts = folder.facts()
    teams: dict[str, list[Row]] = {}
    for row in book.rows:
        teams.setdefault(row.submission, []).append(row)
    records = {entry.id: folder.current(entry, facts) for entry in facts.entries}
    reports = {name: folder.report(name) or {} if record else {} for name, record in records.items()}
    found = tuple(_line(rows, book, records.get(name)) for name, rows in sorted(teams.items()) if rows[0].submission)
    totals = tuple(
        line.row.total for line in found if line.row.total is not None and line.row.state is not State.REFUSED
    )
    known = [record for record in records.values() if record is not None]
    return Overview(
        facts=facts,
        lines=found,
        bars=tuple(_histogram(totals, int(book.max))),
        hard=tuple(_hardest(book, reports.values())),
        states=tuple(Counter(row.state.value for row in book.rows).most_common()),
        flags=tuple(_flags(reports)),
        errors=tuple(record for record in known if record.status is Status.ERROR),
        slowest=tuple(sorted(known, key=lambda record: -record.seconds)[:_SLOWEST]),
        totals=totals,
        missing=tuple(row.person.label for row in book.rows if row.state is State.MISSING),
    )


def render(overview: Overview, book: Gradebook) -> str:
    """Return the page as HTML. Its only script sorts and filters the table."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    environment = Environment(
        loader=FileSystemLoader(HERE), autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    style, script = ((HERE / name).read_text(encoding="utf-8") for name in ("overview.css", "overview.js"))
    return environment.get_template("overview.html.j2").render(
        overview=overview,
        book=book,
        style=style,
        script=script,
        style_hash=_hash(style),
        script_hash=_hash(script),
        line=one_line,
    )


def _hash(text: str) -> str:
    return base64.b64encode(hashlib.sha256(text.encode()).digest()).decode("ascii")


def _line(rows: Sequence[Row], book: Gradebook, record: Record | None) -> Line:
    row = book.teams[rows[0].submission]
    points = {each.id: each for each in row.requirements}
    criteria = tuple(
        sum((points[r.id].points or NOTHING for r in criterion.requirements if r.id in points), NOTHING)
        for criterion in book.rubric.criteria
    )
    cells = tuple(
        (r.id, _share(points[r.id].points, points[r.id].max) if r.id in points else None)
        for r in book.rubric.requirements
    )
    people = ", ".join(one_line(each.person.label) for each in rows)
    reached = level(float(row.total), float(row.max)) if row.total is not None and row.max else ""
    remarks = "; ".join(dict.fromkeys(each.comment for each in rows if each.comment))
    return Line(row, people, remarks, criteria, cells, reached, record.seconds if record else 0.0, record is not None)


def _share(points: Decimal | None, maximum: Decimal) -> int | None:
    return None if points is None or not maximum else int(100 * points / maximum)


def _histogram(totals: Sequence[Decimal], maximum: int) -> Iterator[Bar]:
    width = max(1, -(-maximum // _BARS))
    counts = Counter(min(int(total // width), _BARS - 1) for total in totals)
    highest = max(counts.values(), default=1)
    for number in range(_BARS):
        count = counts[number]
        yield Bar(number * width, min((number + 1) * width, maximum), count, 100 * count / highest)


def _hardest(book: Gradebook, reports: Iterable[dict[str, Any]]) -> Iterator[Hard]:
    """Return the requirements with the smallest share of points, those that nobody lost left out."""
    measured: dict[str, list[Mapping[str, Any]]] = {}
    for report in reports:
        for each in report.get("requirements", ()):
            if each["max"]:
                measured.setdefault(each["id"], []).append(each)
    found = []
    for requirement in book.rubric.requirements:
        several = measured.get(requirement.id, [])
        lost = [each for each in several if each["points"] < each["max"]]
        if lost:
            seen = Counter(one_line(each["seen"], _SEEN) for each in lost if each["seen"]).most_common(1)
            words, count = seen[0] if seen else ("", 0)
            share = int(100 * sum(each["points"] / each["max"] for each in several) / len(several))
            found.append(Hard(requirement.id, requirement.title, share, len(lost), words, count))
    yield from sorted(found, key=lambda hard: hard.share)[:_WORST]


def _flags(reports: Mapping[str, dict[str, Any]]) -> Iterator[tuple[str, str, str]]:
    for name, report in sorted(reports.items()):
        for flag in report.get("integrity", ()):
            yield name, one_line(flag["kind"]), lines(flag["what"], 300)
