"""index.html: a class at a glance, as one self-contained page."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from decimal import Decimal
from functools import cache
from pathlib import Path
from statistics import mean, median
from typing import Any

from grader.classroom import gradebook
from grader.classroom.class_folder import OVERVIEW, ClassFolder, Record, Status
from grader.classroom.gradebook import NOTHING, Gradebook, Row, State
from grader.host.tempdir import write_atomically
from grader.report.html import digest
from grader.sanitize import lines, one_line, prose
from grader.scoring.rubric import Rubric
from grader.words import counted

HERE = Path(__file__).parent
_WORDS = 240  # characters of a message
# Not the digits of a name: `ros2_robot_controller`, F4 and `test_2` stay what they are.
_NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:[.:]\d+)*(?:e[-+]?\d+)?(?!\w)")
_CUT = re.compile(r"\s*\S+ \(… characters more\)")  # what sanitize says of a text that it has cut


@dataclass(frozen=True)
class Line:
    """One submission in the table: points by criterion, None if not graded, and whether it has a report."""

    row: Row
    people: str
    remarks: str
    criteria: tuple[Decimal | None, ...]
    seconds: float | None
    linked: bool


@dataclass
class Loss:
    """What points were lost for, without its numbers: a first cause, or a check that failed or was not reached.

    `lost` are the points by submission, `section` is where the course teaches it.
    """

    kind: str
    requirement: str
    words: str
    section: str
    lost: dict[str, float] = field(default_factory=dict)

    @property
    def points(self) -> float:
        """Return the points that all of them lost."""
        return sum(self.lost.values())


def attempt(folder: ClassFolder) -> None:
    """Write the page of a class that is being graded. A mistake, as in overrides.yaml, is said at the end."""
    with suppress(Exception):
        write(folder, gradebook.read(folder))


def write(folder: ClassFolder, book: Gradebook) -> Path:
    """Write the page into the class folder and return its path. Its only script sorts and filters the table."""
    facts = folder.facts()
    records = {entry.id: folder.current(entry, facts) for entry in facts.entries}
    reports = {name: folder.report(name) if record else {} for name, record in records.items()}
    teams: dict[str, list[Row]] = {}
    for row in book.rows:
        if row.submission:
            teams.setdefault(row.submission, []).append(row)
    found = [_line(rows, book, records.get(name), bool(reports.get(name))) for name, rows in sorted(teams.items())]
    totals = [each.row.total for each in found if each.row.total is not None and each.row.state is not State.REFUSED]
    style, script = ((HERE / f"overview.{kind}").read_text(encoding="utf-8") for kind in ("css", "js"))
    page = _template().render(
        book=book, facts=facts, lines=found, line=one_line, prose=prose, counted=counted,
        style=style, style_hash=digest(style), script=script, script_hash=digest(script),
        held=[each for each in found if any(r.withheld for r in each.row.requirements)],
        states=Counter(row.state.value for row in book.rows).most_common(),
        flags=list(_flags(reports)),
        doubts=sorted(facts.doubts, key=lambda doubt: not doubt.stops),
        notes=[note for note in facts.notes if note not in {doubt.what for doubt in facts.doubts}],
        missing=[row.person.label for row in book.rows if row.state is State.MISSING],
        errors=[record for record in records.values() if record and record.status is Status.ERROR],
        mean=float(mean(totals or [NOTHING])), median=float(median(totals or [NOTHING])),
        losses=losses(reports, book.rubric), league=league(book, reports),
    )  # fmt: skip
    write_atomically(folder.path / OVERVIEW, page)
    return folder.path / OVERVIEW


@cache
def _template() -> Any:
    """Return the template of all pages: to compile it takes a tenth of a second."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    environment = Environment(
        loader=FileSystemLoader(HERE), autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    return environment.get_template("overview.html.j2")


def _line(rows: Sequence[Row], book: Gradebook, record: Record | None, linked: bool) -> Line:
    """Return the line of a submission; its people are named in it."""
    row = book.teams[rows[0].submission]
    points = {each.id: each.points for each in row.requirements if each.points is not None}
    known = [[points[r.id] for r in criterion.requirements if r.id in points] for criterion in book.rubric.criteria]
    said = (each.comment.removeprefix(each.state.value).removeprefix("; ") for each in rows)  # the state is beside it
    return Line(
        row=row,
        people=", ".join(one_line(each.person.label) for each in rows),
        remarks="; ".join(dict.fromkeys(filter(None, said))),
        criteria=tuple(sum(several, NOTHING) if several else None for several in known),
        seconds=record.seconds if record else None,
        linked=linked,
    )


def league(
    book: Gradebook, reports: Mapping[str, Mapping[str, Any]]
) -> list[tuple[int, Row, tuple[float | None, ...]]]:
    """Return rank, submission and figures by points, then by the figures that the rubric names, the best first.

    A figure that was not reached ranks behind any that was. It is empty where the rubric names no figures.
    """
    figures = book.rubric.league
    keyed = []
    for row in (row for row in book.teams.values() if figures and row.state is not State.PENDING):
        checks = [check for r in reports.get(row.submission, {}).get("requirements", ()) for check in r["checks"]]
        measured = {name: value for check in checks for name, value in check.get("figures", {}).items()}
        own = tuple(measured.get(figure.name) for figure in figures)
        signed = [
            math.inf if value is None else -value if figure.most else value
            for figure, value in zip(figures, own, strict=True)
        ]
        keyed.append(((-(row.total or NOTHING), *signed), row, own))
    keys = [key for key, _, _ in keyed]
    ranked = [(1 + sum(other < key for other in keys), row, own) for key, row, own in keyed]
    return sorted(ranked, key=lambda each: (each[0], each[1].submission))


def losses(reports: Mapping[str, Mapping[str, Any]], whole: Rubric) -> list[Loss]:
    """Return what the submissions lost points for, by their report.json, the dearest first."""
    found: dict[tuple[str, str, str], Loss] = {}
    sections = {requirement.id: requirement.section for requirement in whole.requirements}

    def add(kind: str, requirement: str, words: str, submission: str, points: float) -> None:
        text = without_numbers(words)
        loss = found.setdefault(
            (kind, requirement, text),
            Loss(kind, requirement, text, sections.get(requirement, "").replace("#", ": ", 1)),
        )
        loss.lost[submission] = loss.lost.get(submission, 0.0) + points

    for submission, report in reports.items():
        if cause := report.get("cause"):
            named = cause["sentence"].partition(" ")[0]
            add("first cause", named if named in sections else "", cause["sentence"], submission, cause["points"])
        elif refused := report.get("refused"):
            add("first cause", "", refused["because"], submission, sum(r.points for r in whole.requirements))
        for each in report.get("requirements", ()):
            for check in each["checks"] if each["id"] in sections else ():
                lost = check.get("worth", 0.0) * (1 - check.get("fraction", 0.0))
                if check["outcome"] == "not_reached":
                    add("not reached", each["id"], check["because"], submission, lost)
                elif check["outcome"] == "failed" or (check["outcome"] == "partial" and lost >= 0.005):
                    add("failed", each["id"], f"{check['sentence']}: {check['seen']}", submission, lost)
    return sorted(found.values(), key=lambda loss: (-round(loss.points, 6), -len(loss.lost)))


def without_numbers(words: str) -> str:
    """Return a message on one line with "…" for each number, so that it is the same for everyone whom it concerns."""
    text = _CUT.sub("…", _NUMBER.sub("…", prose(words.replace("`", ""))))
    return text if len(text) <= _WORDS else f"{text[:_WORDS]}…"


def _flags(reports: Mapping[str, dict[str, Any]]) -> Iterator[tuple[str, str, str, str]]:
    """Yield of each flag the submission, its kind, what was seen, and where; those that concern requirements first."""
    flags = [(name, flag) for name, report in sorted(reports.items()) for flag in report.get("integrity", ())]
    for name, flag in sorted(flags, key=lambda each: not each[1].get("requirements")):
        trial = f"trial {flag['trial']}" if flag.get("trial") else ""
        ids = f"concerns {', '.join(flag['requirements'])}" if flag.get("requirements") else ""
        seen_in = "; ".join(filter(None, [one_line(flag["where"]), one_line(trial), ids]))
        yield name, one_line(flag["kind"]), lines(flag["what"].replace("`", ""), 300), seen_in
