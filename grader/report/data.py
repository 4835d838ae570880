"""Render a grading or a refusal as report.json. docs/report-format.md describes every field."""

from __future__ import annotations

import hashlib
import json
import math
from dataclasses import asdict
from pathlib import Path
from typing import Any

from grader.evidence import Reason, Trial, from_data, to_data
from grader.host.tempdir import write_atomically
from grader.report import cause
from grader.sanitize import one_line, shown
from grader.scoring.grading import Grading, HandIn, Refusal, foremost
from grader.scoring.rubric import FLAGS, Check
from grader.scoring.scorecard import CheckResult, Outcome, RequirementScore
from grader.words import say

DATA = "report.json"
SCHEMA = "ros2-course-kit/report/1"
REFUSAL_SCHEMA = "ros2-course-kit/refusal/1"
_PROVENANCE = ("rubric", "rubric_title", "checks", "commit", "graded", "rescored")
_OF_A_CHECK = ("fraction", "sentence", "seen", "expected", "because", "trial")


def as_data(result: Grading | Refusal, hand_in: HandIn | None = None) -> dict[str, Any]:
    """Return the report as plain data, with all text safe to show."""
    made = _refusal(result.shown()) if isinstance(result, Refusal) else _grading(result)
    return made | {"hand_in": plain(hand_in)}


def plain(hand_in: HandIn | None) -> dict[str, Any]:
    """Return what a report says of a hand-in."""
    found: dict[str, Any] = json.loads(json.dumps(asdict(shown(hand_in or HandIn()))))
    return found


def _of(thing: object, *names: str) -> dict[str, Any]:
    """Return some fields of an object by their names, which are those of the report."""
    return {name: getattr(thing, name) for name in names}


def _refusal(refusal: Refusal) -> dict[str, Any]:
    return {
        "schema": REFUSAL_SCHEMA,
        **_of(refusal, "submission", "source", "notes", "environment", "seed", "rubric_title"),
        "refused": {"because": refusal.because, "try": refusal.try_},
        "wall_seconds": _finite(refusal.wall_seconds),
        "graded": refusal.refused,
    }


def _grading(grading: Grading) -> dict[str, Any]:
    trials, first = grading.evidence.trials, cause.find(grading)
    grading = grading.shown()
    card, evidence = grading.scorecard, grading.evidence
    intake, origin = evidence.intake, evidence.origin
    return {
        "schema": SCHEMA,
        **_of(grading, "submission", "seed", "environment", "worth", *_PROVENANCE),
        **_of(intake, "sha256", "package", "notes"),
        "source": origin.get("source", ""),
        "choice": {"path": intake.package_path, "because": intake.chosen_because, "others": intake.others},
        "total": card.points,
        **_of(card, "max", "complete"),
        "cause": {"sentence": first.sentence if first else "", "points": first.lost if first else 0.0},
        "criteria": [
            _of(score.criterion, "id", "title")
            | _of(score, "points", "max", "level", "words")
            | {"worth": score.criterion.points}
            for score in card.criteria
        ],
        "requirements": [_requirement(score) for score in card.requirements],
        "flags": FLAGS[grading.withholds],
        "integrity": [
            _of(flag, "kind", "what", "where", "trial") | {"requirements": grading.concerned(flag)}
            for flag in evidence.flags
        ],
        "kept": evidence.kept,
        "confinement": origin.get("confinement", ""),
        "build": _of(evidence.build, "ok", "cached"),
        "trials": [_trial(trial) for trial in trials.values()],
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
    return [
        CheckResult(
            check["id"],
            **{name: check[name] for name in _OF_A_CHECK},
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


def _requirement(score: RequirementScore) -> dict[str, Any]:
    requirement, first = score.requirement, foremost(score)
    checks = zip(requirement.checks, score.results, strict=True)
    return {
        **_of(requirement, "id", "criterion", "title", "text", "section", "level"),
        **_of(score, "points", "max", "withheld"),
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
        **_of(result, *_OF_A_CHECK),
        "level": check.level,
        "outcome": result.outcome.value,
        "fraction": _finite(result.fraction) or 0.0,
        "worth": check.points,
        "try": result.try_,
        "reason": to_data(result.reason),
        "figures": {name: value for name, value in result.figures.items() if math.isfinite(value)},
    }


def _trial(trial: Trial) -> dict[str, Any]:
    said = {name: one_line(str(getattr(trial, name) or "")) for name in ("name", "node", "world", "pace", "ended")}
    return said | {
        "seed": trial.seed,
        "sim_seconds": _finite(trial.samples[-1].t if trial.samples else 0.0),
        "wall_seconds": _finite(trial.wall_seconds),
    }


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


# -- whose report a folder has, so that a grading does not write over another submission's ----------------------------
def of_another(folder: Path, source: Path, sha256: str = "") -> str:
    """Return what `folder` has in place of a report of what is at `source`, or of the same content; "" if nothing."""
    try:
        data = read(folder / DATA)
    except (FileNotFoundError, NotADirectoryError):
        return ""
    except (OSError, ValueError, RecursionError):
        return say("a {file} that is not one of this kit's", file=DATA)
    if data.get("source") == fingerprint(source) or (sha256 and data.get("sha256") == sha256):
        return ""
    return say("the report of {submission}", submission=data["submission"])


def fingerprint(source: Path) -> str:
    """Return a fingerprint of a submission's place on this machine. It tells places apart and names none."""
    return hashlib.sha256(str(source.resolve()).encode(errors="surrogateescape")).hexdigest()[:16]
