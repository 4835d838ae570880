"""index.html: a class at a glance, as one self-contained page."""

from __future__ import annotations

import base64
import hashlib
import math
import time
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from decimal import Decimal
from functools import cache
from pathlib import Path
from statistics import mean, median
from typing import Any

from grader.classroom import causes, gradebook, regrades, similarity
from grader.classroom.causes import Causes
from grader.classroom.class_folder import OVERVIEW, ClassFacts, ClassFolder, Record, Status
from grader.classroom.doubt import Doubt
from grader.classroom.gradebook import NOTHING, Gradebook, Row, State
from grader.classroom.regrades import Regrade
from grader.classroom.similarity import Pair
from grader.host.atomic import write_atomically
from grader.sanitize import lines, one_line, prose
from grader.scoring.rubric import Figure
from grader.scoring.scorecard import level
from grader.words import counted

HERE = Path(__file__).parent
_BARS = 10
_SLOWEST = 5
_PAGE_SHARE = 50  # times as long as the page took is waited before it is written again


@dataclass(frozen=True)
class Line:
    """One submission in the table: its points by criterion, and each requirement's in percent; None if not graded.

    `withheld` are the requirements whose points an integrity flag keeps until a person decides.
    """

    row: Row
    people: str
    remarks: str
    criteria: tuple[Decimal | None, ...]
    cells: tuple[tuple[str, int | None], ...]
    level: str
    seconds: float | None
    linked: bool
    """Whether it has a report."""
    withheld: tuple[str, ...] = ()


@dataclass(frozen=True)
class Standing:
    """One line of the league: its rank, and the figures that the rubric ranks by, None for one that was not reached."""

    rank: int
    line: Line
    figures: tuple[float | None, ...]


@dataclass(frozen=True)
class Bar:
    """One bar of the histogram: how many reached at least `low` and less than `high` points."""

    low: int
    high: int
    count: int
    height: float


@dataclass(frozen=True)
class Overview:
    """All that the page shows."""

    facts: ClassFacts
    lines: tuple[Line, ...]
    league: tuple[Standing, ...]
    bars: tuple[Bar, ...]
    causes: Causes
    shares: tuple[int | None, ...]
    alike: tuple[Pair, ...]
    requests: tuple[Regrade, ...]
    states: tuple[tuple[str, int], ...]
    flags: tuple[tuple[str, str, str, str], ...]
    errors: tuple[Record, ...]
    slowest: tuple[Record, ...]
    totals: tuple[Decimal, ...]
    missing: tuple[str, ...]

    @property
    def linked(self) -> frozenset[str]:
        """Return the submissions that have a report."""
        return frozenset(line.row.submission for line in self.lines if line.linked)

    @property
    def doubts(self) -> tuple[Doubt, ...]:
        """Return what a person should look at: what stops a class first."""
        return tuple(sorted(self.facts.doubts, key=lambda doubt: not doubt.stops))

    @property
    def notes(self) -> tuple[str, ...]:
        """Return the remarks on the export that are not doubts."""
        return tuple(note for note in self.facts.notes if note not in {doubt.what for doubt in self.facts.doubts})

    @property
    def mean(self) -> float:
        """Return the mean of the totals, 0 without any."""
        return float(mean(self.totals)) if self.totals else 0.0

    @property
    def median(self) -> float:
        """Return the median of the totals, 0 without any."""
        return float(median(self.totals)) if self.totals else 0.0


class LivePage:
    """The page of a class that is being graded: written as that goes on, but not so often that it takes long."""

    def __init__(self, folder: ClassFolder) -> None:
        """Write the page of a class that is about to be graded."""
        self._folder = folder
        self._next = 0.0
        self.write()

    def write(self) -> None:
        """Write the page. What is wrong meanwhile, as in overrides.yaml, is said at the end and stops no grading."""
        begun = time.monotonic()
        with suppress(Exception):
            write(self._folder, gradebook.read(self._folder))
        now = time.monotonic()
        self._next = now + _PAGE_SHARE * (now - begun)

    def write_if_due(self) -> None:
        """Write the page, unless the last time was a moment ago."""
        if time.monotonic() >= self._next:
            self.write()


def write(folder: ClassFolder, book: Gradebook) -> Path:
    """Write the page into the class folder and return its path."""
    found = summarise(folder, book)
    write_atomically(folder.path / OVERVIEW, render(found, book))
    return folder.path / OVERVIEW


def summarise(folder: ClassFolder, book: Gradebook) -> Overview:
    """Return what there is to say about a class. One row stands for its team; the people are named in it."""
    facts = folder.facts()
    teams: dict[str, list[Row]] = {}
    for row in book.rows:
        teams.setdefault(row.submission, []).append(row)
    records = {entry.id: folder.current(entry, facts) for entry in facts.entries}
    said = {name: folder.report(name) for name, record in records.items() if record}
    reports = {name: said.get(name) or {} for name in records}
    found = tuple(
        _line(rows, book, records.get(name), bool(reports.get(name)))
        for name, rows in sorted(teams.items())
        if rows[0].submission
    )
    totals = tuple(
        line.row.total for line in found if line.row.total is not None and line.row.state is not State.REFUSED
    )
    known = [record for record in records.values() if record is not None]
    return Overview(
        facts=facts,
        lines=found,
        league=_league(found, book.rubric.league, reports),
        bars=tuple(_histogram(totals, int(book.max))),
        causes=causes.count(reports, book.rubric),
        shares=tuple(_mean_share([dict(line.cells)[r.id] for line in found]) for r in book.rubric.requirements),
        alike=similarity.near(folder),
        requests=tuple(each for each in regrades.read(folder.path, list(records), book.rubric) if each.is_open),
        states=tuple(Counter(row.state.value for row in book.rows).most_common()),
        flags=tuple(_flags(reports)),
        errors=tuple(record for record in known if record.status is Status.ERROR),
        slowest=tuple(sorted(known, key=lambda record: -record.seconds)[:_SLOWEST]),
        totals=totals,
        missing=tuple(row.person.label for row in book.rows if row.state is State.MISSING),
    )


def render(overview: Overview, book: Gradebook) -> str:
    """Return the page as HTML. Its only script sorts and filters the table."""
    script = (HERE / "overview.js").read_text(encoding="utf-8")
    return _page("overview.html.j2", overview=overview, book=book, script=script, script_hash=_hash(script))


def _page(template: str, **shown: Any) -> str:
    style = (HERE / "overview.css").read_text(encoding="utf-8")
    return str(
        _environment()
        .get_template(template)
        .render(style=style, style_hash=_hash(style), line=one_line, prose=prose, counted=counted, **shown)
    )


@cache
def _environment() -> Any:
    """Return the environment of all pages: it compiles a template once, which takes a tenth of a second."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    return Environment(
        loader=FileSystemLoader(HERE), autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )


def _hash(text: str) -> str:
    return base64.b64encode(hashlib.sha256(text.encode()).digest()).decode("ascii")


def _line(rows: Sequence[Row], book: Gradebook, record: Record | None, linked: bool) -> Line:
    row = book.teams[rows[0].submission]
    points = {each.id: each for each in row.requirements}
    criteria = tuple(
        _sum(points[r.id].points for r in criterion.requirements if r.id in points)
        for criterion in book.rubric.criteria
    )
    cells = tuple(
        (r.id, _share(points[r.id].points, points[r.id].max) if r.id in points else None)
        for r in book.rubric.requirements
    )
    people = ", ".join(one_line(each.person.label) for each in rows)
    reached = level(float(row.total), float(row.max)) if row.total is not None and row.max else ""
    said = (each.comment.removeprefix(each.state.value).removeprefix("; ") for each in rows)  # the state is beside it
    remarks = "; ".join(dict.fromkeys(filter(None, said)))
    withheld = tuple(each.id for each in row.requirements if each.withheld)
    return Line(row, people, remarks, criteria, cells, reached, record.seconds if record else None, linked, withheld)


def _league(
    found: Sequence[Line], figures: Sequence[Figure], reports: Mapping[str, dict[str, Any]]
) -> tuple[Standing, ...]:
    """Return the submissions by points, then by the figures, the best first; () where the rubric names no figures.

    A figure that was not reached ranks behind any that was.
    """
    if not figures:
        return ()
    keyed = []
    for line in (line for line in found if line.seconds is not None):
        checks = [check for r in reports.get(line.row.submission, {}).get("requirements", ()) for check in r["checks"]]
        measured = {name: value for check in checks for name, value in check.get("figures", {}).items()}
        own = tuple(measured.get(figure.name) for figure in figures)
        signed = [
            math.inf if value is None else -value if figure.most else value
            for figure, value in zip(figures, own, strict=True)
        ]
        keyed.append(((-(line.row.total or NOTHING), *signed), line, own))
    keys = [key for key, _, _ in keyed]
    ranked = [Standing(1 + sum(other < key for other in keys), line, own) for key, line, own in keyed]
    return tuple(sorted(ranked, key=lambda standing: standing.rank))


def _sum(points: Iterable[Decimal | None]) -> Decimal | None:
    """Return the sum of the points that there are, None if there are none yet."""
    given = [each for each in points if each is not None]
    return sum(given, NOTHING) if given else None


def _share(points: Decimal | None, maximum: Decimal) -> int | None:
    return None if points is None or not maximum else int(100 * points / maximum)


def _histogram(totals: Sequence[Decimal], maximum: int) -> Iterator[Bar]:
    width = max(1, -(-maximum // _BARS))
    counts = Counter(min(int(total // width), _BARS - 1) for total in totals)
    highest = max(counts.values(), default=1)
    for number in range(_BARS):
        count = counts[number]
        yield Bar(number * width, min((number + 1) * width, maximum), count, 100 * count / highest)


def _mean_share(shares: Sequence[int | None]) -> int | None:
    known = [share for share in shares if share is not None]
    return round(mean(known)) if known else None


def _flags(reports: Mapping[str, dict[str, Any]]) -> Iterator[tuple[str, str, str, str]]:
    """Yield of each flag the submission, its kind, what was seen, and where; those that concern requirements first."""
    flags = [(name, flag) for name, report in sorted(reports.items()) for flag in report.get("integrity", ())]
    for name, flag in sorted(flags, key=lambda each: not each[1].get("requirements")):
        trial = f"trial {flag['trial']}" if flag.get("trial") else ""
        ids = f"concerns {', '.join(flag['requirements'])}" if flag.get("requirements") else ""
        seen_in = "; ".join(filter(None, [one_line(flag["where"]), one_line(trial), ids]))
        yield name, one_line(flag["kind"]), lines(flag["what"].replace("`", ""), 300), seen_in
