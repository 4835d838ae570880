"""Answer `check("F4")`: the grader's own checks on the student's package, and words where they cannot even begin."""

from __future__ import annotations

import os
import tempfile
import threading
from collections.abc import Sequence
from pathlib import Path

from grader import build, pipeline
from grader.errors import KitError, SubmissionError
from grader.notebook import prerequisites
from grader.notebook.feedback import Answer, Checked, Note, Progress
from grader.notebook.workspace import NOTEBOOK, Workspace
from grader.report.album import Album, Picture
from grader.scoring import rubric
from grader.scoring.grading import Grading, losses, place, points
from grader.scoring.rubric import RUBRIC, Requirement
from grader.scoring.scorecard import Outcome, RequirementScore
from grader.settings import Settings

MUTATION_BUDGET_S = 3.0  # for T3: a round or two of ten faults, where the grading tries forty
_PICTURES = 2

# One grading at a time in this process: two would only wait for each other's cores.
_LOCK = threading.Lock()


def check(workspace: Workspace, requirements: Sequence[str]) -> Checked:
    """Return how the named requirements come out on the workspace's package.

    Raises:
        ValueError: there is no requirement of that name.
    """
    whole = rubric.load(RUBRIC)
    wanted = [_requirement(whole, name) for name in requirements]
    notebook = os.environ.get(NOTEBOOK, "")
    gaps = {r.id: prerequisites.first_gap(workspace.package, r.id, notebook) for r in wanted}
    possible = [r.id for r in wanted if gaps[r.id] is None]
    answers = {r.id: _impossible(r, gap) for r in wanted if (gap := gaps[r.id]) is not None}
    pictures: tuple[Picture, ...] = ()
    notes: tuple[str, ...] = ()
    if possible:
        progress = Progress()
        try:
            with _LOCK, tempfile.TemporaryDirectory(prefix="check-") as scratch:
                grading = _grade(workspace.package, Path(scratch), whole, possible, progress)
            answers |= {score.requirement.id: _answer(score, grading) for score in _judged(grading)}
            pictures, notes = _pictures(grading), _remarks(grading)
        except SubmissionError as error:
            seen = prerequisites.Gap(str(error), "a package that can be read", "mend what is named here")
            answers |= {r.id: _impossible(r, seen) for r in wanted if r.id in possible}
        except KitError as error:
            answers |= {r.id: _unjudged(r, str(error)) for r in wanted if r.id in possible}
        finally:
            progress.done()
    return Checked(tuple(answers[r.id] for r in dict.fromkeys(wanted)), pictures, notes)


def _requirement(whole: rubric.Rubric, name: str) -> Requirement:
    try:
        return whole.requirement(name)
    except KeyError:
        known = ", ".join(requirement.id for requirement in whole.requirements)
        raise ValueError(f"There is no requirement {name!r}. There are {known}.") from None


def _grade(package: Path, scratch: Path, whole: rubric.Rubric, wanted: list[str], progress: Progress) -> Grading:
    settings = Settings(
        rubric=whole, cache=build.cache_folder(), requirements=tuple(wanted), mutation_budget_s=MUTATION_BUDGET_S,
        progress=progress.say,
    )  # fmt: skip
    return pipeline.grade(package, scratch / "out", settings)


def _judged(grading: Grading) -> list[RequirementScore]:
    return [s for s in grading.shown().scorecard.requirements if s.outcome is not Outcome.NOT_GRADED]


def _impossible(requirement: Requirement, gap: prerequisites.Gap) -> Answer:
    rows = (("seen", gap.seen), ("expected", gap.expected), ("try", gap.try_))
    return Answer(
        requirement.id, requirement.title, "0", points(requirement.points), passed=False,
        notes=(Note(requirement.text, rows),), section=_learn(requirement),
    )  # fmt: skip


def _unjudged(requirement: Requirement, words: str) -> Answer:
    note = Note(requirement.text, (("because", words),))
    return Answer(requirement.id, requirement.title, "0", points(requirement.points), False, ours=True, notes=(note,))


def _answer(score: RequirementScore, grading: Grading) -> Answer:
    notes = []
    for loss in losses(score):
        result = loss.result
        rows = (("seen", result.seen), ("because", result.because), ("expected", result.expected), ("try", result.try_))
        kept = [(name, value) for name, value in rows if value]
        if result.outcome is Outcome.NOT_REACHED:
            kept = _not_reached(result.because, result.expected or result.sentence, grading)
        notes.append(Note(loss.heading, tuple(kept)))
    requirement = score.requirement
    return Answer(
        requirement.id, requirement.title, points(score.points), points(requirement.points),
        passed=score.outcome is Outcome.PASSED, ours=score.outcome is Outcome.ERROR, notes=_once(notes),
        section=_learn(requirement),
    )  # fmt: skip


def _not_reached(because: str, expected: str, grading: Grading) -> list[tuple[str, str]]:
    """Return rows for what could not be tried: what stood in the way counts as seen."""
    found = grading.evidence.build
    if found.ok:
        return [("seen", because), ("expected", expected), ("try", prerequisites.advice(because))]
    return [
        ("seen", f"the package does not build: {prerequisites.first_error(found)}"),
        ("expected", expected),
        ("try", "mend the first error that the build names, then the others are often gone too"),
    ]


def _once(notes: list[Note]) -> tuple[Note, ...]:
    """Return the notes; where all stumble over the same thing, one that stands for all."""
    if len(notes) > 1 and len({dict(note.rows).get("seen") for note in notes}) == 1:
        return (Note(notes[0].heading, notes[0].rows),)
    return tuple(notes)


def _learn(requirement: Requirement) -> str:
    return f"Taught in {place(requirement.section)}."


def _remarks(grading: Grading) -> tuple[str, ...]:
    """Return what a reader should know of how this was judged."""
    mutation = grading.evidence.mutation
    if mutation is None:
        return ()
    tried = sum(fault.outcome != "not tried" for fault in mutation.mutants)
    return (f"A taste of T3: {tried} faults were put in here. The grading puts in more, and others.",)


def _pictures(grading: Grading) -> tuple[Picture, ...]:
    """Return pictures of the first trials in which points were lost."""
    album = Album(grading.evidence.trials, most=_PICTURES)
    return tuple(picture for score in grading.scorecard.requirements for picture in album.of(score.lost))
