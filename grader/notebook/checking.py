"""Answer `check("F4")`: run the grader's checks on the student's package and word the results for its author."""

from __future__ import annotations

import os
import shutil
import tempfile
import threading
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from grader import building, pipeline
from grader.collect import needs_build
from grader.errors import KitError, SubmissionError
from grader.notebook import check_process, prerequisites, standing
from grader.notebook.feedback import Answer, Checked, Note, Progress, seen_expected_try
from grader.notebook.workspace import FRESH, NOTEBOOK, Workspace, course
from grader.report.figures import Album, Figure
from grader.scoring import rubric
from grader.scoring.grading import Grading, Loss, at_hand_in, losses, place, points
from grader.scoring.rubric import Requirement, Rubric
from grader.scoring.scorecard import WITHHELD, Outcome, RequirementScore
from grader.settings import Reuse, Settings
from grader.words import mark, say

MUTATION_BUDGET_S = 3.0  # for T3: one or two rounds of ten mutants, where the grading tries fifty
_PICTURES = 2

# One grading at a time in this process: two would only compete for the same cores.
_LOCK = threading.Lock()


def check(workspace: Workspace, requirements: Sequence[str]) -> Checked:
    """Return the results of the named requirements for the workspace's package.

    Raises:
        ValueError: there is no such requirement.
    """
    whole = rubric.load(course().rubric)
    checkable = [requirement.id for requirement in whole.requirements if requirement.can_be_checked]
    names = [*dict.fromkeys(requirements or checkable)]
    wanted = [_requirement(whole, name) for name in names if name not in whole.dropped]
    notes = [say("{name} is not graded in this course.", name=name) for name in names if name in whole.dropped]
    notebook = os.environ.get(NOTEBOOK, "")
    ids = {requirement.id for requirement in whole.requirements}
    rows = {r.id: row for r in wanted if (row := prerequisites.stand_in(r.id, notebook)) and row["requirement"] in ids}
    asked = {r.id: whole.requirement(rows[r.id]["requirement"]) if r.id in rows else r for r in wanted}
    answers: dict[str, Answer] = {}
    for r in wanted:
        if not r.can_be_checked:
            answers[r.id] = _answer(r, elsewhere=r.waits)
        elif gap := prerequisites.first_gap(workspace.package, asked[r.id].id, notebook):
            answers[r.id] = _answer(r, Note(r.text, seen_expected_try(*gap)))
    possible = [r for r in wanted if r.id not in answers]
    pictures: tuple[Figure, ...] = ()
    try:
        if possible:
            with Progress() as progress:
                grading = _grade(workspace.package, whole, list(dict.fromkeys(asked[r.id] for r in possible)), progress)
            scores = {score.requirement.id: score for score in grading.shown().scorecard.requirements}
            for r in possible:
                score, row = scores[asked[r.id].id], rows.get(r.id)
                answers[r.id] = _stood_in(r, row, score, grading) if row else _judged(score, grading, notebook)
            pictures = _pictures(grading, notebook)
            notes += [grading.unchanged] if grading.unchanged else []
    except SubmissionError as error:
        found = seen_expected_try(error, say("a package that can be read"), say("fix the problem named here"))
        answers |= {r.id: _answer(r, Note(r.text, found)) for r in possible}
    except KitError as error:
        because = ((say("because"), str(error)),)
        answers |= {r.id: _answer(r, Note(r.text, because), ours=True) for r in possible}
    given = tuple(answers[r.id] for r in wanted)
    standing.note(workspace, given)
    if not requirements and (rest := at_hand_in(whole.requirements)):
        reached, worth = sum(float(each.points) for each in given), sum(float(each.worth) for each in given)
        words = mark("{reached} of {worth} points that can be judged here.")
        notes.append(say(words, reached=points(reached), worth=points(worth)) + " " + rest)
    return Checked(given, pictures, tuple(notes))


def _requirement(whole: Rubric, name: str) -> Requirement:
    try:
        return whole.requirement(name)
    except KeyError:
        known = ", ".join(requirement.id for requirement in whole.requirements)
        raise ValueError(say("There is no requirement {name!r}. There are {known}.", name=name, known=known)) from None


def _grade(package: Path, whole: Rubric, wanted: list[Requirement], progress: Progress) -> Grading:
    settings = Settings(
        rubric=whole, course=course(), cache=building.cache_folder(),
        requirements=tuple(requirement.id for requirement in wanted),
        mutation_budget_s=MUTATION_BUDGET_S, best_effort=True,
        reuse=Reuse.unless(FRESH in os.environ), progress=progress.say,
    )  # fmt: skip
    # Text alone is read in a second; a process of its own for it would take as long.
    beside = prerequisites.interfaces_beside(package)
    grade = check_process.grade if needs_build(settings) else pipeline.grade
    with _LOCK, tempfile.TemporaryDirectory(prefix="check-") as scratch:
        if beside:  # together, as they are handed in, and nothing else of the workspace
            together = Path(scratch) / "src"
            for folder in (package, *beside):
                ignored = shutil.ignore_patterns("__pycache__", ".git")
                shutil.copytree(folder, together / folder.name, symlinks=True, ignore=ignored)
            package = together
        return grade(package, Path(scratch) / "out", settings)


def _answer(requirement: Requirement, *notes: Note, reached: float = 0.0, passed: bool = False, **more: Any) -> Answer:
    return Answer(
        requirement.id, requirement.title, points(reached), points(requirement.points), passed, notes=notes,
        section=say("Taught in {place}.", place=place(requirement.section)) if requirement.section else "", **more,
    )  # fmt: skip


def _judged(score: RequirementScore, grading: Grading, notebook: str) -> Answer:
    """Return the answer for a requirement; a check that waits for a later notebook does not keep it from passing."""
    lost = losses(score)
    waiting = {loss.check.id: found for loss in lost if (found := prerequisites.later(loss.check.id, notebook))}
    notes = _each_reason_once([_note(loss, grading) for loss in lost if loss.check.id not in waiting])
    so_far_passed = bool(waiting) and not notes
    if so_far_passed:
        words = mark("notebook {notebook} brings {words}")
        brings = [say(words, notebook=row["notebook"], words=say(row["words"])) for row in waiting.values()]
        notes = [Note("", ((say("later"), "; ".join(brings)),))]
    remarks = dict.fromkeys(r.seen for r in score.results if r.outcome is Outcome.PASSED and r.seen)
    notes += [Note("", ((say("seen"), remark),)) for remark in remarks]
    if score.withheld:
        flags = (flag for flag in grading.evidence.flags if score.requirement.id in grading.concerned(flag))
        said = [f"{flag.kind}: {flag.what}" for flag in flags]
        notes.append(Note(say(WITHHELD), ((say("seen"), "\n".join(said)),)))
    return _answer(
        score.requirement, *notes, reached=score.points, passed=so_far_passed or score.outcome is Outcome.PASSED,
        ours=score.outcome is Outcome.ERROR, so_far=so_far_passed, sample=_sample(score.requirement.id, grading),
    )  # fmt: skip


def _each_reason_once(notes: list[Note]) -> list[Note]:
    """Return the notes without those that say for another check what one before has said."""
    found: dict[str, Note] = {}
    for note in notes:
        found.setdefault(dict(note.rows).get(say("seen"), note.heading), note)
    return list(found.values())


def _stood_in(
    requirement: Requirement, instead: Mapping[str, str], score: RequirementScore, grading: Grading
) -> Answer:
    """Return the answer for a requirement by another one's check, which gives no points."""
    notes = [_note(loss, grading) for loss in losses(score) if loss.check.id == instead["check"]]
    passed = not notes and score.outcome is not Outcome.ERROR
    if passed:
        notes = [Note("", ((say("seen"), say(instead["words"])),))]
    return _answer(requirement, *notes, passed=passed, ours=score.outcome is Outcome.ERROR, so_far=passed)


def _note(loss: Loss, grading: Grading) -> Note:
    result = loss.result
    if result.outcome is Outcome.NOT_REACHED:  # the reason is shown as what was seen
        seen, try_, build = result.because, prerequisites.advice(result.reason), grading.evidence.build
        if not build.ok:
            seen = say("the package does not build: {error}", error=prerequisites.first_error(build))
            try_ = say("fix the first error of the build; others often go with it")
        return Note(loss.heading, seen_expected_try(seen, result.expected or result.sentence, try_))
    named = {"seen": result.seen, "because": result.because, "expected": result.expected, "try": result.try_}
    return Note(loss.heading, tuple((say(name), value) for name, value in named.items() if value))


def _sample(requirement: str, grading: Grading) -> str:
    """Return in words that only some of its mutants were tried, "" if all were, or for another requirement."""
    mutation = grading.evidence.mutation
    if requirement != course().requirement_of("check_mutation") or mutation is None:
        return ""
    tried, every = sum(mutant.outcome != "not tried" for mutant in mutation.mutants), len(mutation.mutants)
    return say("a sample: {tried} of {every} mutants tried", tried=tried, every=every) if tried < every else ""


def _pictures(grading: Grading, notebook: str) -> tuple[Figure, ...]:
    """Return pictures of the first trials in which points were lost."""
    album = Album(grading.evidence.trials, most=_PICTURES)
    lost = [result for score in grading.scorecard.requirements for result in score.lost]
    found = [album.of(result) for result in lost if not prerequisites.later(result.id, notebook)]
    return tuple(dict.fromkeys(figure for figure in found if figure is not None and figure.source))
