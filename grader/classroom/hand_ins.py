"""What a class knows of a submission, as its report shows it.

Reports that say something else are written anew; after a change of the rubric or of a check a class is judged again
from its saved evidence. No student code runs.
"""

from __future__ import annotations

import datetime as dt
import os
import shutil
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

from grader import collect, evidence, pipeline, report
from grader.checks import checks_run
from grader.classroom import gradebook, overrides, times
from grader.classroom.class_folder import RUBRIC, ClassFacts, ClassFolder, Entry, Record, Status
from grader.classroom.gradebook import Gradebook, Row, rounded
from grader.classroom.overrides import Decisions, PersonDecision
from grader.course import Course, named
from grader.errors import GraderError
from grader.host import provenance
from grader.host.tempdir import not_interrupted, write_atomically
from grader.report import data
from grader.report.data import DATA
from grader.scoring import rubric
from grader.scoring.grading import Final, Grading, HandIn, Refusal
from grader.scoring.rubric import Rubric
from grader.settings import Settings
from grader.trials import source as trial_runs

_TOGETHER = 4  # submissions for each process at a time
Change = tuple[str, str, str, str]
"""A submission, a requirement, and its points before and after, in words."""


def hand_in(entry: Entry, facts: ClassFacts, decided: Decisions, rows: Sequence[Row] = ()) -> HandIn:
    """Return what is known of one of the class's entries; `rows` are its people's lines, once it is graded.

    All of a team read one report, so it names no member's extension or reason. What one person alone may read, their
    own extension too, is in the report of a submission with one row.
    """
    on = decided.on(entry.id)
    alone = rows[0].person if len(rows) == 1 else entry.people[0] if len(entry.people) == 1 else None
    about = decided.about(alone) if alone else PersonDecision()
    given = [each.override for each in rows[0].requirements if each.override] if rows else on.points
    deadline = about.extension.until if about.extension else facts.deadline
    return HandIn(
        people=tuple(person.label for person in entry.people),
        team=next((person.team for person in entry.people if person.team), ""),
        name=entry.path.as_posix(),
        submitted=_time(entry.submitted),
        deadline=f"{_time(facts.deadline)}; extended to {_time(deadline)}" if about.extension else _time(deadline),
        late=_late(entry, deadline, facts.late_rule),
        decisions=tuple(given),
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


def rescore(
    folder: ClassFolder,
    new_rubric: Path | None = None,
    progress: Callable[[int, int], None] = lambda _done, _total: None,
) -> tuple[int, list[Change]]:
    """Run the checks over the evidence of every graded submission, and write the reports anew.

    Return how many were judged again, and what changed. `progress` is called with how many are done, of how many.

    Raises:
        GraderError: there is no such class, or a check needs evidence that was not collected.
    """
    with folder.locked():
        facts = folder.facts()
        course = named(facts.course)
        source = new_rubric or folder.path / RUBRIC
        whole = rubric.load(source, checks_run.known(course))
        text = source.read_text(encoding="utf-8")
        records = [record for entry in facts.entries if (record := folder.record(entry.id)) is not None]
        graded = [record for record in records if record.status is Status.GRADED]
        wanted = tuple(requirement.id for requirement in whole.requirements if requirement.checks)
        _require_evidence(folder, graded, Settings(whole, folder.path, course=course, requirements=wanted))
        decided = overrides.of_class(folder, facts, whole)
        now = overrides.applied(facts, decided)
        known = {entry.id: hand_in(entry, facts, decided) for entry in now.entries}
        judged: list[dict[str, str]] = []
        with ProcessPoolExecutor() as pool:
            made = {record.id: folder.working(record.id) for record in graded}
            orders = ((folder.submission(r.id), made[r.id], whole, r.seed, known[r.id], facts.course) for r in graded)
            for points in pool.map(_judge, orders, chunksize=_TOGETHER):
                judged.append(points)
                progress(len(judged), len(graded))
        # All or none: an interrupted run must not leave half a class judged by another rubric.
        changes: list[Change] = []
        with not_interrupted():
            for record, after in zip(graded, judged, strict=True):
                before = _points(folder.report(record.id))
                pairs = [(each, before.get(each, "none"), after.get(each, "none")) for each in before | after]
                changes += [(record.id, *pair) for pair in pairs if pair[1] != pair[2]]
                judge = provenance.kit_hash(course.folder)
                folder.keep(made[record.id], replace(record, rubric=whole.sha256, judge=judge))
            folder.write_facts(replace(facts, rubric=whole.sha256))
            write_atomically(folder.path / RUBRIC, text)
    return len(graded), changes


def _points(said: Mapping[str, Any]) -> dict[str, str]:
    """Return the points of a report.json by requirement, in words; those without any are left out."""
    return {
        each["id"]: "withheld" if each["outcome"] == "withheld" else str(rounded(each["points"]))
        for each in said.get("requirements", ())
        if each["max"] or each["outcome"] == "withheld"
    }


def _judge(order: tuple[Path, Path, Rubric, int, HandIn, str]) -> dict[str, str]:
    """Judge one submission into a new folder, and return its points by requirement. Runs in a process of its own."""
    old, new, whole, seed, known, course = order
    settings = Settings(rubric=whole, cache=new, course=named(course), seed=seed)
    grading = pipeline.judge(old / pipeline.EVIDENCE, settings)
    first = data.circumstances(data.read(old / DATA))
    grading = replace(grading, wall_seconds=first["wall_seconds"], graded=first["graded"], rescored=provenance.now())
    shutil.copytree(old / pipeline.EVIDENCE, new / pipeline.EVIDENCE, copy_function=os.link)
    report.write(grading, new, hand_in=known)
    return _points(data.read(new / DATA))


def _require_evidence(folder: ClassFolder, graded: Iterable[Record], settings: Settings) -> None:
    """Check that all evidence which the wanted requirements need was collected, or say which command collects it."""
    trials = trial_runs.wanted(settings)
    for record in graded:
        found = evidence.load(folder.submission(record.id) / pipeline.EVIDENCE)
        needed = sorted(source.name for source in collect.SOURCES if source.serves(settings) & settings.checked)
        collected = found.origin["sources"].split(", ") if "sources" in found.origin else needed
        lacking = [name for name in needed if name not in collected]
        if found.build.ok and (new := sorted(set(trials) - set(found.trials))):
            lacking.append(f"the trial {', '.join(new)}")
        if lacking:
            raise GraderError(
                f"{record.id} lacks evidence of {' and of '.join(lacking)}: it was collected by an earlier kit, or for "
                "another rubric. Collect it with `grader batch --out CLASS --rubric FILE --fresh`, or with --regrade "
                "after an update of the kit."
            )


def _late(entry: Entry, deadline: dt.datetime | None, late_rule: str) -> str:
    if entry.submitted is None or deadline is None:
        return times.MARKED if entry.late else ""
    said = times.late_by(entry.submitted, deadline, times.late_rule(late_rule) if late_rule else None)
    return f"by {said}{f'; the rule is: {late_rule}' if late_rule else ''}" if said else ""


def _time(time: dt.datetime | None) -> str:
    return time.isoformat(sep=" ", timespec="seconds") if time else ""
