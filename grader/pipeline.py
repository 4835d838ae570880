"""From a submission to a grading, as a list one can read: take in, collect, keep the evidence, check, score.

Everything of the submission runs in `collect`; below that line no student code runs, and `judge` can be repeated.
"""

from __future__ import annotations

import errno
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

from grader import evidence, report, sandbox
from grader.checks import checks_run
from grader.collect import SOURCES, collect, kept_evidence
from grader.collect import explain as explain_jobs
from grader.course import name_of, reader
from grader.errors import GraderError, SubmissionError, UsageError
from grader.evidence import Evidence, Flag
from grader.host import namespaces, provenance, shortage, submission_user, tempdir
from grader.intake.submission import open_submission
from grader.processes import jobs
from grader.processes.jobs import Job, Where
from grader.processes.kept import NOTHING_KEPT
from grader.sanitize import printable
from grader.scoring.grading import Grading, Refusal
from grader.scoring.rubric import Rubric
from grader.scoring.scorecard import CheckResult, Outcome, score
from grader.settings import Settings
from grader.source import Subject
from grader.words import say

__all__ = ["EVIDENCE", "Settings", "explain", "grade", "judge", "observe"]

EVIDENCE = report.EVIDENCE


def grade(
    source: Path,
    out: Path,
    settings: Settings,
    write: Callable[[Grading | Refusal, Path], object] = lambda _result, _folder: None,
    *,
    overwrite: bool = True,
) -> Grading:
    """Grade the submission `source`, leave the evidence in `out`, and return the grading.

    `write` puts reports of the grading, or of the refusal to grade, into a folder; they appear in `out` together with
    the evidence. If anything else fails, nothing appears and what is in `out` stays as it was. Without `overwrite`,
    reports of another submission stay, too.

    Raises:
        SubmissionError: there is nothing in it that could be graded.
        UsageError: `out` cannot be written or has another submission's report, or there is no package at the path that
            the settings name.
        GraderError: this host cannot grade.
    """
    started = time.monotonic()
    with _room(source, out, settings) as fresh:
        try:
            evidence.save(_collected(source, out, settings, overwrite=overwrite), fresh / EVIDENCE)
        except SubmissionError as error:
            if not overwrite:
                _require_own(out, source)
            write(_refusal(source, error, settings, time.monotonic() - started), fresh)
            if any(fresh.iterdir()):
                (fresh / EVIDENCE).mkdir()  # takes the place of an earlier grading's
            refused = error
        else:
            settings.progress(say("checking the evidence"))
            grading = replace(judge(fresh / EVIDENCE, settings), wall_seconds=time.monotonic() - started)
            settings.progress(say("writing the report"))
            write(grading, fresh)
            return grading
    raise refused


def observe(source: Path, out: Path, settings: Settings) -> None:
    """Leave the evidence of the submission `source` in `out`, to be judged by another process.

    Raises:
        SubmissionError, UsageError, GraderError: as by `grade`.
    """
    with _room(source, out, settings) as fresh:
        evidence.save(_collected(source, out, settings), fresh / EVIDENCE)


def explain(source: Path, settings: Settings) -> list[tuple[Job[Any], str]]:
    """Return the jobs of a grading of `source`, each with when its kept result was made, "" if it would be done now.

    Raises:
        SubmissionError, GraderError: as by `grade`.
    """
    require_host(settings)
    with taken_in(source, settings) as subject:
        return explain_jobs(subject)


@contextmanager
def taken_in(source: Path, settings: Settings, leave_out: Path | None = None) -> Iterator[Subject]:
    """Take a submission in, without a folder inside of it to `leave_out`; what jobs use is closed in the end."""
    with tempdir.folder("grading") as folder, submission_user.readable_by_sandboxes(), ExitStack() as closing:
        submission = open_submission(
            source, folder / "submission", settings.course, package=settings.package_path, leave_out=leave_out
        )
        (folder / "work").mkdir()
        yield Subject(submission, settings, folder / "work", closing)


def require_host(settings: Settings) -> None:
    """Check that this host can grade, and say as whom submissions run."""
    shortage.require_memory()
    sandbox.require(for_points=not settings.requirements)
    if said := submission_user.notice():
        settings.progress(said)


@contextmanager
def _room(source: Path, out: Path, settings: Settings) -> Iterator[Path]:
    """Yield an empty folder whose entries will replace those in `out`, if this host can grade the source."""
    require_host(settings)
    if not source.exists():
        raise SubmissionError(
            say("There is no file or folder {path}.", path=printable(str(source))), say("Check the path.")
        )
    try:
        with ExitStack() as stack:
            try:
                fresh = stack.enter_context(tempdir.replace_entries(out))
            except OSError as error:
                if error.errno in (errno.ENOSPC, errno.EDQUOT):
                    raise
                raise UsageError(
                    say("Cannot write to {path}: {why}.", path=printable(str(out)), why=error.strerror),
                    say("Choose another --out."),
                ) from error
            yield fresh
    except OSError as error:
        # A failed write does not say where.
        if shortage.explain(error) and (said := shortage.explain_disk(out) or shortage.explain_disk(tempdir.parent())):
            raise GraderError(said) from error
        raise


def judge(
    folder: Path, settings: Settings, earlier: Sequence[CheckResult] = (), *, keep_verdict: bool = False
) -> Grading:
    """Run the checks over the evidence in `folder`, score what they find, and return the grading.

    A check that has an `earlier` result is not run; its requirement should not be among those that the settings want.
    With `keep_verdict` what the checks found of the same evidence is taken and kept as the evidence is.
    """
    known = {result.id for result in earlier}
    to_run = [check.id for requirement in settings.wanted for check in requirement.checks if check.id not in known]
    found = evidence.load(folder)
    job = Job(
        "the checks", Where.HOST, list[CheckResult], lambda: checks_run.run(settings.course, folder, to_run),
        decided_by=(evidence.digest(found), *to_run),
        lasting=lambda results: not any(result.outcome is Outcome.ERROR for result in results),
    )  # fmt: skip
    done = jobs.run([job], kept_evidence(settings) if keep_verdict else NOTHING_KEPT)
    return _scored(found, settings, [*earlier, *done.results[job.name]])


def _scored(found: Evidence, settings: Settings, results: Sequence[CheckResult]) -> Grading:
    """Score the results of the checks over the evidence, and return the grading."""
    known = {result.id for result in results}
    concerned = sorted({source for flag in found.flags for source in flag.concerns})
    concerns = {each: sorted(checks_run.served(settings.course, settings.rubric, each)) for each in concerned}
    scored = {r.id for r in settings.rubric.requirements if {check.id for check in r.checks} <= known}
    rubric = _only(settings.rubric, scored | {r.id for r in settings.wanted})
    return Grading(
        scorecard=score(rubric, results, {name for names in concerns.values() for name in names}),
        evidence=found,
        environment=provenance.environment(),
        submission=found.intake.name,
        seed=settings.seed,
        wall_seconds=0.0,
        rubric=settings.rubric.sha256,
        rubric_title=settings.rubric.title,
        checks=provenance.checks_hash(settings.course.folder),
        commit=provenance.commit(),
        graded=provenance.now(),
        held_back=tuple(sorted(reader.held_back_names(settings.course))),
        concerns=concerns,
        withholds=rubric.withholds,
    )


def _require_own(out: Path, source: Path, sha256: str = "") -> None:
    """Check that `out` has no report, or that of the submission `source` with the content `sha256`."""
    if found := report.of_another(out, source, sha256):
        raise UsageError(
            say("{path} has {found}; nothing was written.", path=printable(str(out)), found=found),
            say("Choose another --out, or replace it with --force."),
        )


def _refusal(source: Path, error: SubmissionError, settings: Settings, seconds: float) -> Refusal:
    return Refusal(
        submission=source.resolve().name,
        because=error.what,
        try_=error.advice,
        notes=list(error.remarks),
        environment=provenance.environment(),
        seed=settings.seed,
        source=report.fingerprint(source),
        wall_seconds=seconds,
        refused=provenance.now(),
        rubric_title=settings.rubric.title,
    )


def _collected(source: Path, out: Path, settings: Settings, *, overwrite: bool = True) -> Evidence:
    """Take the submission in, collect the evidence, and add what made it. It will go to `out`."""
    settings.progress(say("taking in {name}", name=printable(source.resolve().name)))
    reports = out if source.resolve() in out.resolve().parents else None  # they are not part of it
    with taken_in(source, settings, reports) as subject:
        if not overwrite:
            _require_own(out, source, subject.submission.intake.sha256)
        found = collect(subject)
    made = {
        "seed": str(settings.seed),
        "course": name_of(settings.course),
        "kit": provenance.kit_hash(settings.course.folder),
        "confinement": namespaces.confinement().value,
        "submission": found.intake.sha256,
        "source": report.fingerprint(source),
        "sources": ", ".join(each.name for each in SOURCES if each.serves(settings) & settings.checked),
    }
    said, disabled = namespaces.notice(), namespaces.sandbox_disabled()
    as_root = say(submission_user.RUNS_AS_ROOT) if not disabled and submission_user.runs_as_root() else ""
    notes = [*filter(None, (as_root, said)), *found.intake.notes]
    flags = [*([Flag("no sandbox", said)] if disabled else []), *found.flags]
    intake = replace(found.intake, notes=notes)
    return replace(found, origin=made | provenance.environment(), intake=intake, flags=flags)


def _only(whole: Rubric, wanted: set[str]) -> Rubric:
    """Return the rubric with the checks of all but the wanted requirements left out: those are "not graded"."""
    return replace(
        whole,
        criteria=tuple(
            replace(c, requirements=tuple(r if r.id in wanted else replace(r, checks=()) for r in c.requirements))
            for c in whole.criteria
        ),
    )
