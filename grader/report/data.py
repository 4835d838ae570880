"""Render a grading or a refusal as report.json. docs/report-format.md describes every field."""

from __future__ import annotations

import hashlib
import json
import math
from dataclasses import asdict
from pathlib import Path
from typing import Any

from grader.evidence import Flag, Reason, Trial, from_data, to_data
from grader.host.tempdir import write_atomically
from grader.report import cause
from grader.sanitize import one_line, shown
from grader.scoring.grading import Grading, HandIn, Refusal, foremost
from grader.scoring.rubric import FLAGS, Check
from grader.scoring.scorecard import CheckResult, CriterionScore, Outcome, RequirementScore
from grader.words import say

DATA = "report.json"
SCHEMA = "ros2-course-kit/report/1"
REFUSAL_SCHEMA = "ros2-course-kit/refusal/1"


def as_data(result: Grading | Refusal, hand_in: HandIn | None = None) -> dict[str, Any]:
    """Return the report as plain data, with all text safe to show."""
    made = _refusal(result.shown()) if isinstance(result, Refusal) else _grading(result)
    return made | {"hand_in": plain(hand_in)}


def plain(hand_in: HandIn | None) -> dict[str, Any]:
    """Return what a report says of a hand-in."""
    found: dict[str, Any] = json.loads(json.dumps(asdict(shown(hand_in or HandIn()))))
    return found


def _refusal(refusal: Refusal) -> dict[str, Any]:
    return {
        "schema": REFUSAL_SCHEMA,
        "submission": refusal.submission,
        "source": refusal.source,
        "refused": {"because": refusal.because, "try": refusal.try_},
        "notes": list(refusal.notes),
        "environment": dict(refusal.environment),
        "seed": refusal.seed,
        "wall_seconds": _finite(refusal.wall_seconds),
        "graded": refusal.refused,
        "rubric_title": refusal.rubric_title,
    }


def _grading(grading: Grading) -> dict[str, Any]:
    trials, first = grading.evidence.trials, cause.find(grading)
    grading = grading.shown()
    card, evidence = grading.scorecard, grading.evidence
    return {
        "schema": SCHEMA,
        "submission": grading.submission,
        "sha256": evidence.intake.sha256,
        "source": evidence.origin.get("source", ""),
        "package": evidence.intake.package,
        "choice": {
            "path": evidence.intake.package_path,
            "because": evidence.intake.chosen_because,
            "others": list(evidence.intake.others),
        },
        "total": card.points,
        "max": card.max,
        "worth": grading.worth,
        "complete": card.complete,
        "cause": {"sentence": first.sentence if first else "", "points": first.lost if first else 0.0},
        "criteria": [_criterion(score) for score in card.criteria],
        "requirements": [_requirement(score) for score in card.requirements],
        "flags": FLAGS[grading.withholds],
        "integrity": [_flag(flag, grading) for flag in evidence.flags],
        "notes": list(evidence.intake.notes),
        "kept": dict(evidence.kept),
        "confinement": evidence.origin.get("confinement", ""),
        "build": {"ok": evidence.build.ok, "cached": evidence.build.cached},
        "trials": [_trial(trial) for trial in trials.values()],
        "environment": dict(grading.environment),
        "seed": grading.seed,
        "rubric": grading.rubric,
        "rubric_title": grading.rubric_title,
        "checks": grading.checks,
        "commit": grading.commit,
        "graded": grading.graded,
        "rescored": grading.rescored,
        "wall_seconds": _finite(grading.wall_seconds),
    }


def as_json(result: Grading | Refusal, hand_in: HandIn | None = None) -> str:
    """Return the report as strict JSON: ASCII, no NaN, a newline at the end."""
    return json.dumps(as_data(result, hand_in), indent=2, allow_nan=False) + "\n"


def write_json(result: Grading | Refusal, path: Path, hand_in: HandIn | None = None) -> None:
    """Write the report as JSON, whole or not at all."""
    write_atomically(path, as_json(result, hand_in))


def read(path: Path) -> dict[str, Any]:
    """Return what `write_json` wrote.

    Raises:
        ValueError: it is not a report.
        OSError: it cannot be read.
    """
    found = json.loads(path.read_text(encoding="utf-8"))
    if not isinstance(found, dict) or found.get("schema") not in (SCHEMA, REFUSAL_SCHEMA):
        raise ValueError(f"{path} is not a report of this kit")
    return found


def results(said: dict[str, Any]) -> list[CheckResult]:
    """Return the checks' results that a report lists."""
    same = ("id", "fraction", "sentence", "seen", "expected", "because", "trial")
    return [
        CheckResult(
            **{name: check[name] for name in same},
            outcome=Outcome(check["outcome"]),
            try_=check["try"],
            reason=from_data(check["reason"], Reason) if check.get("reason") else None,
            figures=check.get("figures", {}),
        )
        for requirement in said.get("requirements", ())
        for check in requirement["checks"]
    ]


def circumstances(said: dict[str, Any]) -> dict[str, Any]:
    """Return the fields of a Grading that say when and by what it was graded, as a report lists them."""
    later = {name: said.get(name, "") for name in ("commit", "graded", "rescored")}
    seconds = float(said.get("wall_seconds") or 0.0)
    return {"environment": said["environment"], "checks": said["checks"], "wall_seconds": seconds, **later}


def refusal(said: dict[str, Any]) -> Refusal:
    """Return the refusal that a report shows."""
    return Refusal(
        submission=said["submission"],
        because=said["refused"]["because"],
        try_=said["refused"]["try"],
        **{name: said[name] for name in ("notes", "environment", "seed", "source")},
        wall_seconds=float(said.get("wall_seconds") or 0.0),
        refused=said.get("graded", ""),
        rubric_title=said.get("rubric_title", ""),
    )


def _flag(flag: Flag, grading: Grading) -> dict[str, Any]:
    return {
        "kind": flag.kind,
        "what": flag.what,
        "where": flag.where,
        "trial": flag.trial,
        "requirements": grading.concerned(flag),
    }


def _criterion(score: CriterionScore) -> dict[str, Any]:
    return {
        "id": score.criterion.id,
        "title": score.criterion.title,
        "points": score.points,
        "max": score.max,
        "worth": score.criterion.points,
        "level": score.level,
        "words": score.words,
    }


def _requirement(score: RequirementScore) -> dict[str, Any]:
    requirement, first = score.requirement, foremost(score)
    checks = zip(requirement.checks, score.results, strict=True)
    return {
        "id": requirement.id,
        "criterion": requirement.criterion,
        "title": requirement.title,
        "text": requirement.text,
        "section": requirement.section,
        "level": requirement.level,
        "points": score.points,
        "max": score.max,
        "withheld": score.withheld,
        "worth": requirement.points,
        "outcome": score.outcome.value,
        "seen": first.seen if first else "",
        "expected": first.expected if first else "",
        "try": first.try_ if first else "",
        "checks": [_check(check, result) for check, result in checks],
    }


def _check(check: Check, result: CheckResult) -> dict[str, Any]:
    return {
        "id": check.id,
        "sentence": result.sentence,
        "level": check.level,
        "outcome": result.outcome.value,
        "fraction": _finite(result.fraction) or 0.0,
        "worth": check.points,
        "seen": result.seen,
        "expected": result.expected,
        "try": result.try_,
        "because": result.because,
        "trial": result.trial,
        "reason": to_data(result.reason),
        "figures": {name: value for name, value in result.figures.items() if math.isfinite(value)},
    }


def _trial(trial: Trial) -> dict[str, Any]:
    return {
        "name": one_line(trial.name),
        "node": one_line(trial.node),
        "world": one_line(trial.world),
        "seed": trial.seed,
        "pace": one_line(trial.pace),
        "ended": one_line(str(trial.ended or "")),
        "sim_seconds": _finite(trial.samples[-1].t if trial.samples else 0.0),
        "wall_seconds": _finite(trial.wall_seconds),
    }


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


# -- whose report a folder has, so that a grading does not write over another submission's ----------------------------
def of_another(folder: Path, source: Path, sha256: str = "") -> str:
    """Return what `folder` has in place of a report of what is at `source`, or of the same content; "" if nothing."""
    try:
        data = json.loads((folder / DATA).read_text(encoding="utf-8"))
    except (FileNotFoundError, NotADirectoryError):
        return ""
    except (OSError, ValueError, RecursionError):
        data = None
    if not isinstance(data, dict) or not str(data.get("schema", "")).startswith("ros2-course-kit/"):
        data = {}
    submission, content, place = (str(data.get(name) or "") for name in ("submission", "sha256", "source"))
    if place == fingerprint(source) or (place and content and content == sha256):
        return ""
    if submission and submission == source.resolve().name and not place:
        return ""
    if submission:
        return say("the report of {submission}", submission=submission)
    return say("a {file} that is not one of this kit's", file=DATA)


def fingerprint(source: Path) -> str:
    """Return a fingerprint of a submission's place on this machine. It tells places apart and names none."""
    return hashlib.sha256(str(source.resolve()).encode(errors="surrogateescape")).hexdigest()[:16]
