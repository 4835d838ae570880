"""Render a grading, or a refusal to grade, for people and programs: console, HTML, JSON. Nothing is judged here.

A student reads of requirements that are held back the points, and nothing that was seen: whatever a check says of a
trial, a node may have put there, in numbers or in words.
"""

from __future__ import annotations

import contextlib
import re
import shutil
from dataclasses import replace
from pathlib import Path

from grader.evidence import Flag, Kind
from grader.host.tempdir import write_atomically
from grader.report.data import DATA, fingerprint, of_another, write_json
from grader.scoring.grading import Grading, HandIn, Refusal
from grader.scoring.scorecard import CheckResult, Outcome, RequirementScore
from grader.words import say

PAGE = "report.html"
EVIDENCE = "evidence"
"""The folder of the evidence, below that of the reports."""


def write(
    result: Grading | Refusal, folder: Path, *, hand_in: HandIn | None = None, pictures: bool = True
) -> tuple[Path, Path]:
    """Write report.json and report.html into `folder` and return their paths.

    `hand_in` is what a class knows of the submission. Without `pictures` nothing reveals the layout of held-out
    trials. Where a course holds something back, the folder for_student/ gets the same two reports without it.
    """
    from grader.report import html  # draws with numpy and the simulator: 0.2 s that a check need not wait for

    as_json, as_html = folder / DATA, folder / PAGE
    write_json(result, as_json, hand_in)
    write_atomically(as_html, html.render(result, hand_in, pictures=pictures))
    own = folder / FOR_STUDENT
    shutil.rmtree(own, ignore_errors=True)
    if isinstance(result, Grading) and holds_back(result):
        own.mkdir()
        write_json(theirs := without_what_is_held_back(result), own / DATA, hand_in)
        write_atomically(own / PAGE, html.render(theirs, hand_in, pictures=pictures))
    return as_json, as_html


def for_student(folder: Path, name: str) -> Path:
    """Return the file `name` of a report in `folder` that its student may read."""
    own = folder / FOR_STUDENT / name
    return own if own.exists() else folder / name


FOR_STUDENT = "for_student"
"""The folder of a student's report, in that of the instructor's; it is there if anything is held back."""

_OF_NO_TRIAL = (Kind.NOT_BUILT, Kind.DEPENDS)


def holds_back(grading: Grading) -> bool:
    """Return whether something of a grading is not for its student."""
    return bool(grading.held_back) or any(score.requirement.held_back for score in grading.scorecard.requirements)


def without_what_is_held_back(grading: Grading) -> Grading:
    """Return a grading without what is held back."""
    card, evidence = grading.scorecard, grading.evidence
    hidden = {name for name in evidence.trials if name in grading.held_back}
    criteria = tuple(replace(c, requirements=tuple(map(_without_what_was_seen, c.requirements))) for c in card.criteria)
    return replace(
        grading,
        scorecard=replace(card, criteria=criteria),
        evidence=replace(
            evidence,
            trials={name: replace(trial, seed=0) for name, trial in evidence.trials.items() if name not in hidden},
            flags=[left for flag in evidence.flags if (left := _without(flag, hidden))],
            kept={what: when for what, when in evidence.kept.items() if what.removeprefix("trial ") not in hidden},
        ),
        seed=0,
        held_back=(),
    )


def _without_what_was_seen(score: RequirementScore) -> RequirementScore:
    """Return the score of a requirement that is held back with its own text in place of all that its checks say."""
    requirement = score.requirement
    if not requirement.held_back:
        return score
    checks = tuple(replace(check, id=f"{requirement.id}.{place}") for place, check in enumerate(requirement.checks, 1))
    results = tuple(
        _result(result, check.id, requirement.text) for check, result in zip(checks, score.results, strict=True)
    )
    return replace(score, requirement=replace(requirement, checks=checks), results=results)


def _result(result: CheckResult, name: str, text: str) -> CheckResult:
    made = CheckResult(name, result.outcome, result.fraction, text, expected=text)
    if result.reason is not None and result.reason.kind in _OF_NO_TRIAL:
        return replace(made, because=str(result.reason), reason=result.reason)
    if result.outcome is Outcome.PASSED:
        return made
    if result.outcome is Outcome.ERROR:
        return replace(made, seen=say("an error of the grader"))
    return replace(made, seen=say("not shown: the requirement is held back"))


def _without(flag: Flag, hidden: set[str]) -> Flag | None:
    """Return a flag without the trials that are held back, None if it was raised in no other.

    What follows a colon in its words may come from the node, and from any of its trials.
    """
    names = flag.trial.split(", ")
    left = [name for name in names if name not in hidden]
    if left == names:
        return flag
    return replace(flag, what=flag.what.partition(":")[0], trial=", ".join(left)) if left else None
