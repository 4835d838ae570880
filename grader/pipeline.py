"""From a submission to a grading, as a list one can read: take in, collect, keep the evidence, check, score.

Everything of the submission runs in `collect`; below that line no student code runs, and `judge` can be repeated.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from grader import evidence, sandbox
from grader.checks import checks_run
from grader.collect import collect
from grader.errors import GraderError
from grader.evidence import Evidence, Flag
from grader.host import atomic, namespaces, provenance, shortage, submission_user, tempdir
from grader.intake.submission import open_submission
from grader.scoring.grading import Grading
from grader.scoring.rubric import Rubric
from grader.scoring.scorecard import score
from grader.settings import Settings

__all__ = ["EVIDENCE", "Settings", "grade", "judge"]

EVIDENCE = "evidence"
"""The folder of the evidence, below that of the reports."""


def grade(
    source: Path,
    out: Path,
    settings: Settings,
    write: Callable[[Grading, Path], object] = lambda _grading, _folder: None,
) -> Grading:
    """Grade the submission `source`, leave the evidence in `out`, and return the grading.

    `write` puts reports of the grading into a folder; they appear in `out` together with the evidence. If anything
    fails, nothing appears and what is in `out` stays as it was.

    Raises:
        SubmissionError: there is nothing in it that could be graded.
        GraderError: this host cannot grade.
    """
    started = time.monotonic()
    shortage.require_memory()
    sandbox.require()
    if said := submission_user.notice():
        settings.progress(said)
    try:
        with atomic.replace_entries(out) as fresh:
            evidence.save(_collected(source, settings), fresh / EVIDENCE)
            settings.progress("checking the evidence")
            grading = replace(judge(fresh / EVIDENCE, settings), wall_seconds=time.monotonic() - started)
            settings.progress("writing the report")
            write(grading, fresh)
    except OSError as error:
        # A failed write does not say where.
        if shortage.explain(error) and (said := shortage.explain_disk(out) or shortage.explain_disk(tempdir.parent())):
            raise GraderError(said) from error
        raise
    return grading


def judge(folder: Path, settings: Settings) -> Grading:
    """Run the checks over the evidence in `folder`, score what they find, and return the grading."""
    results = checks_run.run(folder, [check.id for requirement in settings.wanted for check in requirement.checks])
    found = evidence.load(folder)
    return Grading(
        scorecard=score(_only(settings.rubric, {requirement.id for requirement in settings.wanted}), results),
        evidence=found,
        environment=provenance.environment(),
        submission=found.intake.name,
        seed=settings.seed,
        wall_seconds=0.0,
    )


def _collected(source: Path, settings: Settings) -> Evidence:
    """Take the submission in, collect the evidence, and add what made it."""
    with tempdir.folder("grading") as folder, submission_user.readable_by_sandboxes():
        settings.progress(f"taking in {source.name}")
        submission = open_submission(source, folder / "submission")
        (folder / "work").mkdir()
        found = collect(submission, folder / "work", settings)
    made = {"seed": str(settings.seed), "kit": provenance.kit_hash(), "submission": found.intake.sha256}
    found = replace(found, origin=made | provenance.environment())
    if namespaces.sandbox_disabled():
        intake = replace(found.intake, notes=[namespaces.UNSAFE_NOTICE, *found.intake.notes])
        flag = Flag("no sandbox", namespaces.UNSAFE_NOTICE)
        found = replace(found, intake=intake, flags=[flag, *found.flags])
    elif submission_user.runs_as_root():
        found = replace(found, intake=replace(found.intake, notes=[submission_user.RUNS_AS_ROOT, *found.intake.notes]))
    return found


def _only(whole: Rubric, wanted: set[str]) -> Rubric:
    """Return the rubric with the checks of all but the wanted requirements left out: those are "not graded"."""
    return replace(
        whole,
        criteria=tuple(
            replace(c, requirements=tuple(r if r.id in wanted else replace(r, checks=()) for r in c.requirements))
            for c in whole.criteria
        ),
    )
