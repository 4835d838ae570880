"""Judge a class once more from its saved evidence: after a change of the rubric or of a check. No student code runs."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

from grader import collect, evidence, pipeline, report
from grader.checks import checks_run
from grader.classroom import hand_ins, overrides
from grader.classroom.class_folder import RUBRIC, ClassFolder, Record, Status
from grader.classroom.gradebook import rounded
from grader.course import named
from grader.errors import GraderError
from grader.host import provenance
from grader.host.atomic import not_interrupted, write_atomically
from grader.report import data
from grader.report.data import DATA
from grader.scoring import rubric
from grader.scoring.grading import HandIn
from grader.settings import Settings
from grader.trials import source as trial_runs

_TOGETHER = 4  # submissions for each process at a time
Change = tuple[str, str, str, str]
"""A submission, a requirement, and its points before and after, in words."""


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
        text = rubric.text(source)
        records = [record for entry in facts.entries if (record := folder.record(entry.id)) is not None]
        graded = [record for record in records if record.status is Status.GRADED]
        wanted = tuple(requirement.id for requirement in whole.requirements if requirement.checks)
        _require_evidence(folder, graded, Settings(whole, folder.path, course=course, requirements=wanted))
        decided = overrides.of_class(folder, facts, whole)
        now = overrides.applied(facts, decided)
        known = {entry.id: hand_ins.hand_in(entry, facts, decided) for entry in now.entries}
        judged: list[dict[str, str]] = []
        with ProcessPoolExecutor() as pool:
            made = {record.id: folder.working(record.id) for record in graded}
            orders = ((folder.submission(r.id), made[r.id], text, r.seed, known[r.id], facts.course) for r in graded)
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
                judge = provenance.kit_hash(course.layers)
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


def _judge(order: tuple[Path, Path, str, int, HandIn, str]) -> dict[str, str]:
    """Judge one submission into a new folder, and return its points by requirement. Runs in a process of its own."""
    old, new, text, seed, known, course = order
    file = new / "rubric.yaml"
    file.write_text(text, encoding="utf-8")
    settings = Settings(rubric=rubric.load(file), cache=new, course=named(course), seed=seed)
    file.unlink()
    grading = pipeline.judge(old / pipeline.EVIDENCE, settings)
    first = data.circumstances(data.read(old / DATA))
    grading = replace(grading, wall_seconds=first["wall_seconds"], graded=first["graded"], rescored=provenance.now())
    shutil.copytree(old / pipeline.EVIDENCE, new / pipeline.EVIDENCE, copy_function=os.link)
    report.write(grading, new, hand_in=known)
    return _points(data.read(new / DATA))


def _require_evidence(folder: ClassFolder, graded: Iterable[Record], settings: Settings) -> None:
    """Check that all evidence which the wanted requirements need was collected.

    Raises:
        GraderError: it was not; the message says for what, and which command collects it.
    """
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
