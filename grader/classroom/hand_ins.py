"""What a class knows of a submission, as its report shows it; reports that say something else are written anew."""

from __future__ import annotations

import datetime as dt
import os
import shutil
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from grader import pipeline, report
from grader.classroom import gradebook, lateness, overrides
from grader.classroom.class_folder import ClassFacts, ClassFolder, Entry, Record
from grader.classroom.gradebook import Gradebook, Row
from grader.classroom.overrides import Decisions, PersonDecision
from grader.course import Course, named
from grader.report import data
from grader.report.data import DATA
from grader.scoring.grading import Decision, Final, Grading, HandIn, Refusal
from grader.scoring.rubric import Rubric
from grader.settings import Settings


def hand_in(entry: Entry, facts: ClassFacts, decided: Decisions, rows: Sequence[Row] = ()) -> HandIn:
    """Return what is known of one of the class's entries; `rows` are its people's lines, once it is graded.

    All of a team read one report, so it names no member's extension or reason. What one person alone may read, their
    own extension too, is in the report of a submission with one row.
    """
    on = decided.on(entry.id)
    submitted = on.submitted or entry.submitted
    alone = rows[0].person if len(rows) == 1 else entry.people[0] if len(entry.people) == 1 else None
    about = decided.about(alone) if alone else PersonDecision()
    given = [each.override for each in rows[0].requirements if each.override] if rows else on.points
    deadline = about.extension.until if about.extension else facts.deadline
    return HandIn(
        people=tuple(person.label for person in entry.people),
        team=next((person.team for person in entry.people if person.team), ""),
        name=entry.path.as_posix(),
        submitted=_time(submitted),
        deadline=f"{_time(facts.deadline)}; extended to {_time(deadline)}" if about.extension else _time(deadline),
        late=_late(entry, submitted, deadline, facts.late_rule),
        decisions=tuple(Decision(o.requirement, float(o.points), o.why, o.by) for o in given),
        comments=(*on.comments, *about.comments),
        finals=tuple(_finals(rows)),
    )


def _finals(rows: Sequence[Row]) -> Iterator[Final]:
    """Return the final figures, none if all are what was measured or are not final."""
    if not any(row.final and (row.grade or row.late or row.decided or row.private) for row in rows):
        return
    everybodys = all((row.figures, row.private) == (rows[0].figures, rows[0].private) for row in rows)
    for row in rows[:1] if everybodys else rows:
        points = float(row.total) if row.final and row.total is not None else None
        state = () if row.final else (row.state.value,)
        because = (*state, *(row.private if everybodys else ()), *row.decided, *filter(None, [row.late]))
        yield Final(() if everybodys else (row.person.label,), points, float(row.max), row.grade, because)


def refresh(folder: ClassFolder) -> list[str]:
    """Write the reports anew that do not say what is known by now, and return their submissions. No check runs.

    Raises:
        GraderError: overrides.yaml has a mistake, or another run writes to the class.
    """
    book = gradebook.read(folder)
    facts = overrides.applied(folder.facts(), book.decisions)
    stale = list(_stale(folder, facts, book))
    if stale:
        with folder.locked():
            for record, known in stale:
                old, new = folder.submission(record.id), folder.working(record.id)
                shutil.copytree(old, new, copy_function=os.link, dirs_exist_ok=True)
                report.write(read_back(old, book.rubric, named(facts.course)), new, hand_in=known)
                folder.keep(new, record)
    return [record.id for record, _ in stale]


def _stale(folder: ClassFolder, facts: ClassFacts, book: Gradebook) -> Iterator[tuple[Record, HandIn]]:
    for entry in facts.entries:
        record, said = folder.record(entry.id), folder.report(entry.id)
        if record is None or "hand_in" not in said:
            continue
        known = hand_in(entry, facts, book.decisions, [row for row in book.every if row.submission == entry.id])
        # A report by another rubric is judged again by the run that brought the rubric.
        if said["hand_in"] != data.plain(known) and said.get("rubric", book.rubric.sha256) == book.rubric.sha256:
            yield record, known


def read_back(folder: Path, whole: Rubric, course: Course) -> Grading | Refusal:
    """Return the grading or the refusal that the report in `folder` shows."""
    said = data.read(folder / DATA)
    if said["schema"] == data.REFUSAL_SCHEMA:
        return data.refusal(said)
    settings = Settings(rubric=whole, cache=folder, course=course, seed=said["seed"])
    grading = pipeline.judge(folder / pipeline.EVIDENCE, settings, data.results(said))
    return replace(grading, **data.circumstances(said))


def _late(entry: Entry, submitted: dt.datetime | None, deadline: dt.datetime | None, late_rule: str) -> str:
    if submitted is None or deadline is None:
        return lateness.MARKED if entry.late else ""
    said = lateness.late_by(submitted, deadline, lateness.parse(late_rule) if late_rule else None)
    return f"by {said}{f'; the rule is: {late_rule}' if late_rule else ''}" if said else ""


def _time(time: dt.datetime | None) -> str:
    return time.isoformat(sep=" ", timespec="seconds") if time else ""
