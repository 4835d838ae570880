"""A grading as its student may read it: of requirements that are held back the points and what was seen, but not where.

Of what is said of such a requirement only the words of its check and of the grader are left: whatever was filled into
them becomes "…", because a node may have said there what it sees, in numbers or in words. So do numbers, and names of a
trial, a check, a world or an obstacle that are held back.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path
from string import Formatter

from grader import KIT
from grader.course import Course, find, named
from grader.course.held_back import words
from grader.evidence import Flag, Reason, Trial
from grader.scoring.grading import Grading
from grader.scoring.rubric import Requirement
from grader.scoring.scorecard import CheckResult, Outcome, RequirementScore
from grader.words import gettext, say, spoken

FOLDER = "for_student"
"""The folder of a student's report, in that of the instructor's; it is there if anything is held back."""

_NUMBER = re.compile(r"(?<![A-Za-z_\d])[-+]?\d+|[-+]?\b(?:inf|nan)\b")
_GAPS = re.compile(r"…(?:[\s,;()/x.:e+-]*…)+")
_WORD = re.compile(r"[^\W\d_]{2,}")
_Text = tuple[str, ...]
"""What a text of the code consists of, without what is filled in between."""


def holds_back(grading: Grading) -> bool:
    """Return whether something of a grading is not for its student."""
    return bool(grading.held_back) or any(score.requirement.held_back for score in grading.scorecard.requirements)


def for_students(grading: Grading) -> Grading:
    """Return a grading without what is held back."""
    card, evidence = grading.scorecard, grading.evidence
    hidden = {name for name in evidence.trials if name in grading.held_back}
    trials = [evidence.trials[name] for name in hidden]
    there = {name for trial in trials for name in (trial.world, *_obstacles(trial))}
    secret = words({*grading.held_back, *there} - {""})
    origin = evidence.origin
    texts = _texts(named(origin["course"]) if "course" in origin else find(), spoken())

    def veiled(text: str) -> str:
        return _GAPS.sub("…", _NUMBER.sub("…", secret.sub("…", _without_fields(text, texts))))

    return replace(
        grading,
        scorecard=replace(
            card,
            criteria=tuple(
                replace(c, requirements=tuple(_veiled(score, veiled) for score in c.requirements))
                for c in card.criteria
            ),
        ),
        evidence=replace(
            evidence,
            trials={name: replace(trial, seed=0) for name, trial in evidence.trials.items() if name not in hidden},
            flags=[left for flag in evidence.flags if (left := _without(flag, hidden))],
            kept={what: when for what, when in evidence.kept.items() if what.removeprefix("trial ") not in hidden},
        ),
        seed=0,
        held_back=(),
    )


def _without_fields(said: str, texts: tuple[_Text, ...]) -> str:
    """Return a sentence with "…" for all that was filled into it; "…" if no text of the code can have made it."""
    made_of = [text for text in texts if _can_be(said, text)]
    return "…".join(max(made_of, key=lambda text: sum(map(len, text)), default=("", "")) if said else ())


def _can_be(said: str, text: _Text) -> bool:
    if len(text) == 1:
        return said == text[0]
    first, *between, last = text
    if not said.startswith(first):
        return False
    at = len(first)
    for part in between:
        if (at := said.find(part, at)) < 0:
            return False
        at += len(part)
    return said.endswith(last) and at + len(last) <= len(said)


@cache
def _texts(course: Course, _language: str) -> tuple[_Text, ...]:
    """Return the texts of checks, and of reasons, that have two words and more."""
    modules = [*course.files("checks", "*.py"), *(KIT / "grader" / "checks").glob("*.py")]
    found = {text for path in (*modules, KIT / "grader" / "evidence" / "reasons.py") for text in _texts_of(path)}
    return tuple(sorted(text for text in found if len(_WORD.findall(" ".join(text))) > 1))


def _text_of(part: ast.expr) -> str | None:
    return part.value if isinstance(part, ast.Constant) and isinstance(part.value, str) else None


def _texts_of(module: Path) -> Iterator[_Text]:
    for node in ast.walk(ast.parse(module.read_text(encoding="utf-8"))):
        if isinstance(node, ast.JoinedStr):
            yield _apart([_text_of(part) for part in node.values])
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield (node.value,)
            for text in (node.value, gettext(node.value)):
                try:
                    fields = [*Formatter().parse(text)]
                except ValueError:  # not one with fields
                    continue
                yield _apart(
                    [part for words, field, _, _ in fields for part in (words, None)[: 1 + (field is not None)]]
                )


def _apart(parts: list[str | None]) -> _Text:
    """Return the words of a text apart where there is a field (None) between them."""
    text = [""]
    for part in parts:
        if part is None:
            text.append("")
        else:
            text[-1] += part
    return tuple(text)


def _obstacles(trial: Trial) -> list[str]:
    """Return the names in a trial's world, and of what was touched."""
    things = [thing for kind in trial.scene.values() if isinstance(kind, list) for thing in kind]
    named = [str(thing["name"]) for thing in things if isinstance(thing, dict) and "name" in thing]
    return named + [touch.obstacle for touch in trial.touches]


def _veiled(score: RequirementScore, veiled: Callable[[str], str]) -> RequirementScore:
    if not score.requirement.held_back:
        return score
    requirement = score.requirement
    checks = tuple(replace(check, id=f"{requirement.id}.{place}") for place, check in enumerate(requirement.checks, 1))
    results = tuple(
        _result(result, check.id, requirement, veiled) for check, result in zip(checks, score.results, strict=True)
    )
    return replace(score, requirement=replace(requirement, checks=checks), results=results)


def _result(result: CheckResult, name: str, requirement: Requirement, veiled: Callable[[str], str]) -> CheckResult:
    """Return the result of a check that is held back, with the requirement's text in place of the check's sentence."""
    because = veiled(str(result.reason)) if result.outcome is Outcome.NOT_REACHED and result.reason else ""
    seen = say("an error of the grader") if result.outcome is Outcome.ERROR else veiled(result.seen)
    return CheckResult(
        name, result.outcome, result.fraction, requirement.text, seen, requirement.text, veiled(result.try_), because,
        reason=_reason(result.reason, veiled) if result.reason else None,
    )  # fmt: skip


def _reason(reason: Reason, veiled: Callable[[str], str]) -> Reason:
    """Return a reason without what a node could have written into it."""
    return replace(reason, exit_code=None, seconds=0.0, place="", nodes=(), said=veiled(reason.said))


def _without(flag: Flag, hidden: set[str]) -> Flag | None:
    """Return a flag without the trials that are held back, None if it was raised in no other.

    What follows a colon in its words may come from the node, and from any of its trials.
    """
    names = flag.trial.split(", ")
    left = [name for name in names if name not in hidden]
    if left == names:
        return flag
    return replace(flag, what=flag.what.partition(":")[0], trial=", ".join(left)) if left else None
