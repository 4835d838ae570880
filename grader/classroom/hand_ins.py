"""What a class knows of a submission, as its report shows it; reports that say something else are written anew."""

from __future__ import annotations

import datetime as dt
import os
import shutil
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from grader import pipeline, report
from grader.classroom import lateness, overrides
from grader.classroom.class_folder import RUBRIC, ClassFacts, ClassFolder, Record
from grader.classroom.entry import Entry
from grader.classroom.overrides import Decisions
from grader.report import data
from grader.report.standing import DATA
from grader.scoring import rubric
from grader.scoring.grading import Decision, Grading, HandIn, Refusal
from grader.scoring.rubric import Rubric
from grader.settings import Settings


def hand_in(entry: Entry, facts: ClassFacts, decided: Decisions) -> HandIn:
    """Return what is known of one of the class's entries."""
    on = decided.on(entry.id)
    submitted = on.submitted or entry.submitted
    extended = {
        person.label: extension.until
        for person in entry.people
        if (extension := decided.about(person).extension) is not None
    }
    deadline = [_time(facts.deadline), *(f"{_time(until)} for {name}" for name, until in extended.items())]
    return HandIn(
        people=tuple(person.label for person in entry.people),
        team=next((person.team for person in entry.people if person.team), ""),
        name=entry.path.as_posix(),
        submitted=_time(submitted),
        deadline="; ".join(filter(None, deadline)),
        late=_late(entry, submitted, facts),
        decisions=tuple(Decision(o.requirement, float(o.points), o.why, o.by) for o in on.points),
        comments=on.comments,
    )


def refresh(folder: ClassFolder) -> list[str]:
    """Write the reports anew that do not say what is known by now, and return their submissions. No check runs.

    Raises:
        GraderError: overrides.yaml has a mistake, or another run writes to the class.
    """
    facts, whole = folder.facts(), rubric.load(folder.path / RUBRIC)
    decided = overrides.of_class(folder, facts, whole)
    stale = list(_stale(folder, facts, decided, whole))
    if stale:
        with folder.locked():
            for record, known in stale:
                old, new = folder.submission(record.id), folder.working(record.id)
                shutil.copytree(old, new, copy_function=os.link, dirs_exist_ok=True)
                report.write(_read_back(old, whole), new, hand_in=known)
                folder.keep(new, record)
    return [record.id for record, _ in stale]


def _stale(
    folder: ClassFolder, facts: ClassFacts, decided: Decisions, whole: Rubric
) -> Iterator[tuple[Record, HandIn]]:
    for entry in facts.entries:
        record, said, known = folder.record(entry.id), folder.report(entry.id), hand_in(entry, facts, decided)
        if record is None or said is None or "hand_in" not in said:
            continue
        # A report by another rubric is judged again by the run that brought the rubric.
        if said["hand_in"] != data.plain(known) and said.get("rubric", whole.sha256) == whole.sha256:
            yield record, known


def _read_back(folder: Path, whole: Rubric) -> Grading | Refusal:
    """Return the grading or the refusal that the report in `folder` shows."""
    said = data.read(folder / DATA)
    if said["schema"] == data.REFUSAL_SCHEMA:
        return data.refusal(said)
    settings = Settings(rubric=whole, cache=folder, seed=said["seed"])
    grading = pipeline.judge(folder / pipeline.EVIDENCE, settings, data.results(said))
    return replace(grading, **data.circumstances(said))


def _late(entry: Entry, submitted: dt.datetime | None, facts: ClassFacts) -> str:
    if submitted is None or facts.deadline is None:
        return "marked as late by the platform, which does not say by how much" if entry.late else ""
    if submitted <= facts.deadline:
        return ""
    rule = lateness.parse(facts.late_rule) if facts.late_rule else None
    units = rule.units(submitted, facts.deadline) if rule else 0
    after = f"{submitted - facts.deadline} after the deadline"
    if rule is None:
        return after
    counted = f"{units} started {rule.unit}{'' if units == 1 else 's'}"
    return f"{after}, {counted}; the rule is: {facts.late_rule}"


def _time(time: dt.datetime | None) -> str:
    return time.isoformat(sep=" ", timespec="seconds") if time else ""
