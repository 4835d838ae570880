"""Answer `check("F4")`: run the grader's checks on the student's package and word the results for its author."""

from __future__ import annotations

import os
import tempfile
import threading
from collections.abc import Sequence
from pathlib import Path

from grader import build, pipeline
from grader.errors import KitError, SubmissionError
from grader.evidence import Mutant, short_name
from grader.notebook import prerequisites
from grader.notebook.feedback import Answer, Checked, Note, Progress, Table
from grader.notebook.workspace import NOTEBOOK, Workspace
from grader.report.album import Album, Picture
from grader.scoring import rubric
from grader.scoring.grading import Grading, losses, place, points
from grader.scoring.rubric import RUBRIC, Requirement, Rubric
from grader.scoring.scorecard import Outcome, RequirementScore
from grader.settings import MUTATION_BUDGET_S as GRADING_BUDGET_S
from grader.settings import Settings

MUTATION_BUDGET_S = 3.0  # for T3: one or two rounds of ten mutants, where the grading tries forty
_PICTURES = 2

# One grading at a time in this process: two would only compete for the same cores.
_LOCK = threading.Lock()


def check(workspace: Workspace, requirements: Sequence[str]) -> Checked:
    """Return the results of the named requirements for the workspace's package.

    Raises:
        ValueError: there is no such requirement.
    """
    whole = rubric.load(RUBRIC)
    wanted = [*dict.fromkeys(_requirement(whole, name) for name in requirements)]
    notebook = os.environ.get(NOTEBOOK, "")
    gaps = {r.id: prerequisites.first_gap(workspace.package, r.id, notebook) for r in wanted}
    answers = {r.id: _lacking(r, gap) for r in wanted if (gap := gaps[r.id])}
    possible = [r for r in wanted if r.id not in answers]
    pictures: tuple[Picture, ...] = ()
    notes: tuple[str, ...] = ()
    tables: tuple[Table, ...] = ()
    if possible:
        progress = Progress()
        try:
            grading = _grade(workspace.package, whole, possible, progress)
            scores = grading.shown().scorecard.requirements
            answers |= {s.requirement.id: _judged(s, grading) for s in scores if s.outcome is not Outcome.NOT_GRADED}
            pictures, notes, tables = _pictures(grading), _remarks(grading), _tables(grading.shown())
        except SubmissionError as error:
            gap = prerequisites.Gap(str(error), "a package that can be read", "fix the problem named here")
            answers |= {r.id: _lacking(r, gap) for r in possible}
        except KitError as error:
            answers |= {r.id: _unjudged(r, str(error)) for r in possible}
        finally:
            progress.done()
    return Checked(tuple(answers[r.id] for r in wanted), pictures, notes, tables)


def _requirement(whole: Rubric, name: str) -> Requirement:
    try:
        return whole.requirement(name)
    except KeyError:
        known = ", ".join(requirement.id for requirement in whole.requirements)
        raise ValueError(f"There is no requirement {name!r}. There are {known}.") from None


def _grade(package: Path, whole: Rubric, wanted: list[Requirement], progress: Progress) -> Grading:
    settings = Settings(
        rubric=whole, cache=build.cache_folder(), requirements=tuple(requirement.id for requirement in wanted),
        mutation_budget_s=MUTATION_BUDGET_S, best_effort=True, progress=progress.say,
    )  # fmt: skip
    with _LOCK, tempfile.TemporaryDirectory(prefix="check-") as scratch:
        return pipeline.grade(package, Path(scratch) / "out", settings)


def _answer(
    requirement: Requirement, notes: tuple[Note, ...], *, reached: float = 0.0, passed: bool = False, ours: bool = False
) -> Answer:
    return Answer(
        requirement.id, requirement.title, points(reached), points(requirement.points), passed, ours, notes,
        section=f"Taught in {place(requirement.section)}.",
    )  # fmt: skip


def _lacking(requirement: Requirement, gap: prerequisites.Gap) -> Answer:
    rows = (("seen", gap.seen), ("expected", gap.expected), ("try", gap.try_))
    return _answer(requirement, (Note(requirement.text, rows),))


def _unjudged(requirement: Requirement, reason: str) -> Answer:
    return _answer(requirement, (Note(requirement.text, (("because", reason),)),), ours=True)


def _judged(score: RequirementScore, grading: Grading) -> Answer:
    notes: list[Note] = []
    unreached: set[str] = set()
    for loss in losses(score):
        result = loss.result
        if result.outcome is Outcome.NOT_REACHED:
            if result.because in unreached:
                continue  # the same reason again: once is enough
            unreached.add(result.because)
            notes.append(Note(loss.heading, _not_reached(result.because, result.expected or result.sentence, grading)))
        else:
            named = (
                ("seen", result.seen), ("because", result.because), ("expected", result.expected), ("try", result.try_),
            )  # fmt: skip
            rows = tuple((name, value) for name, value in named if value)
            notes.append(Note(loss.heading, rows))
    notes += [Note("", (("seen", remark),)) for remark in _remarks_on(score)]
    return _answer(
        score.requirement, tuple(notes), reached=score.points, passed=score.outcome is Outcome.PASSED,
        ours=score.outcome is Outcome.ERROR,
    )  # fmt: skip


def _remarks_on(score: RequirementScore) -> list[str]:
    """Return what was noticed by checks that passed, each remark once."""
    said = [result.seen for result in score.results if result.outcome is Outcome.PASSED and result.seen]
    return list(dict.fromkeys(said))


def _not_reached(because: str, expected: str, grading: Grading) -> tuple[tuple[str, str], ...]:
    """Return the rows for a check that could not be judged; the reason is shown as what was seen."""
    found = grading.evidence.build
    if found.ok:
        return ("seen", because), ("expected", expected), ("try", prerequisites.advice(because))
    seen = f"the package does not build: {prerequisites.first_error(found)}"
    return ("seen", seen), ("expected", expected), ("try", "fix the first error of the build; others often go with it")


def _remarks(grading: Grading) -> tuple[str, ...]:
    """Return how this check differs from the grading, in sentences."""
    tried = _tried(grading)
    if not tried:
        return ()
    return (
        f"A sample of T3: {len(tried)} mutants, what fits into {MUTATION_BUDGET_S:g} s of running your tests. "
        f"The grading has {GRADING_BUDGET_S:g} s, so it tries more, and different ones.",
    )


def _tables(grading: Grading) -> tuple[Table, ...]:
    """Return every mutant that was tried, what it changed, and which test noticed it."""
    tried = _tried(grading)
    if not tried:
        return ()
    rows = tuple(
        (
            "✓ " + short_name(mutant.by)
            if mutant.outcome == "noticed"
            else _MISSED.get(mutant.outcome, mutant.outcome),
            f"{mutant.path}:{mutant.line}",
            mutant.words,
        )
        for mutant in sorted(tried, key=lambda mutant: (mutant.path, mutant.line))
    )
    return (Table(f"All {len(tried)} mutants", ("noticed by", "place", "change"), rows),)


_MISSED = {"unnoticed": "no test", "unreached": "no test reaches this line"}


def _tried(grading: Grading) -> list[Mutant]:
    mutation = grading.evidence.mutation
    return [mutant for mutant in mutation.mutants if mutant.outcome != "not tried"] if mutation else []


def _pictures(grading: Grading) -> tuple[Picture, ...]:
    """Return pictures of the first trials in which points were lost."""
    album = Album(grading.evidence.trials, most=_PICTURES)
    return tuple(picture for score in grading.scorecard.requirements for picture in album.of(score.lost))
