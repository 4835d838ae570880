"""Judge a class once more from its saved evidence: after a change of the rubric or of a check. No student code runs."""

from __future__ import annotations

import hashlib
import os
import shutil
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path

from grader import collect, evidence, pipeline, report
from grader.checks import checks_run
from grader.classroom import comparison, hand_ins, overrides
from grader.classroom.class_folder import RUBRIC, ClassFolder, Record, Status
from grader.classroom.comparison import Difference
from grader.course import named
from grader.errors import GraderError
from grader.host import provenance
from grader.host.atomic import not_interrupted, write_atomically
from grader.report import data
from grader.report.standing import DATA
from grader.scoring import rubric
from grader.scoring.grading import HandIn
from grader.settings import Settings
from grader.trials import source as trial_runs

_TOGETHER = 4  # submissions for each process at a time


@dataclass(frozen=True)
class Rescored:
    """What was done: how many were judged again, and what changed."""

    judged: int
    changes: tuple[Difference, ...]


def rescore(
    folder: ClassFolder, *, only: Sequence[str] = (), new_rubric: Path | None = None, jobs: int = 0,
    progress: Callable[[int, int], None] = lambda _done, _total: None,
) -> Rescored:  # fmt: skip
    """Run the checks over the evidence of every graded submission, and write the reports anew.

    With `only`, the other requirements keep their results. `progress` is called with how many are done, of how many.

    Raises:
        GraderError: there is no such class or requirement, or a check needs evidence that was not collected.
    """
    with folder.locked():
        facts = folder.facts()
        course = named(facts.course)
        source = new_rubric or folder.path / RUBRIC
        whole = rubric.load(source, checks_run.known(course))
        text = rubric.text(source)
        if unknown := sorted(set(only) - {requirement.id for requirement in whole.requirements}):
            raise GraderError(f"The rubric has no requirement {', '.join(unknown)}.")
        records = [record for entry in facts.entries if (record := folder.record(entry.id)) is not None]
        graded = [record for record in records if record.status is Status.GRADED]
        wanted = [r.id for r in whole.requirements if r.checks and (not only or r.id in only)]
        _require_evidence(
            folder, graded, Settings(rubric=whole, cache=folder.path, course=course, requirements=tuple(wanted))
        )
        rubric_hash = hashlib.sha256(text.encode()).hexdigest()
        decided = overrides.of_class(folder, facts, whole)
        known = {
            entry.id: hand_ins.hand_in(entry, facts, decided) for entry in overrides.applied(facts, decided).entries
        }
        judged: list[tuple[Record, dict[str, str]]] = []
        with ProcessPoolExecutor(jobs or os.cpu_count() or 1) as pool:
            made = {record.id: folder.working(record.id) for record in graded}
            orders = (
                (folder.submission(r.id), made[r.id], text, r.seed, tuple(only), known[r.id], facts.course)
                for r in graded
            )
            results = pool.map(_judge, orders, chunksize=_TOGETHER)
            for record, points in zip(graded, results, strict=True):
                judged.append((record, points))
                progress(len(judged), len(graded))
        # All or none: an interrupted run must not leave half a class judged by another rubric.
        found: list[Difference] = []
        with not_interrupted():
            for record, points in judged:
                found += comparison.changes(record.id, comparison.points(folder.report(record.id) or {}), points)
                folder.keep(
                    made[record.id], replace(record, rubric=rubric_hash, judge=provenance.kit_hash(course.layers))
                )
            folder.write_facts(replace(facts, rubric=rubric_hash))
            write_atomically(folder.path / RUBRIC, text)
    return Rescored(len(graded), tuple(found))


def _judge(order: tuple[Path, Path, str, int, tuple[str, ...], HandIn, str]) -> dict[str, str]:
    """Judge one submission into a new folder, and return its points by requirement. Runs in a process of its own."""
    old, new, text, seed, only, known, course = order
    file = new / "rubric.yaml"
    file.write_text(text, encoding="utf-8")
    settings = Settings(rubric=rubric.load(file), cache=new, course=named(course), seed=seed, requirements=only)
    file.unlink()
    before = data.read(old / DATA)
    earlier = [result for result in data.results(before) if result.id in _kept(settings)] if only else []
    grading = pipeline.judge(old / pipeline.EVIDENCE, settings, earlier)
    first = data.circumstances(before)
    grading = replace(grading, wall_seconds=first["wall_seconds"], graded=first["graded"], rescored=provenance.now())
    shutil.copytree(old / pipeline.EVIDENCE, new / pipeline.EVIDENCE, copy_function=os.link)
    report.write(grading, new, hand_in=known)
    return comparison.points(data.read(new / DATA))


def _kept(settings: Settings) -> set[str]:
    """Return the checks that are not run again."""
    again = {check.id for requirement in settings.wanted for check in requirement.checks}
    return {check.id for check in settings.rubric.checks} - again


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
                "another rubric. Collect it with `grader batch SOURCE --out CLASS` and the rubric, or leave out the "
                "requirements with --only."
            )
