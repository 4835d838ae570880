"""Compare two gradings, or two classes: which requirements changed for whom, and what changed that decides them."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from grader.classroom.class_folder import CLASS, SUBMISSIONS, ClassFolder
from grader.classroom.gradebook import rounded
from grader.errors import GraderError
from grader.pipeline import EVIDENCE
from grader.report import data
from grader.report.standing import DATA


@dataclass(frozen=True)
class Difference:
    """A requirement whose points differ. `why` names what else differs: input, evidence, checks, rubric, seed, kit."""

    submission: str
    requirement: str
    before: str
    after: str
    why: tuple[str, ...] = ()


def compare(old: Path, new: Path) -> tuple[list[Difference], list[str]]:
    """Return the differences between two gradings or two classes, and remarks on what only one of them has.

    Raises:
        GraderError: one of the folders is neither.
    """
    before, after = _gradings(old), _gradings(new)
    alone = [f"{name} is only in {old}" for name in sorted(set(before) - set(after))]
    alone += [f"{name} is only in {new}" for name in sorted(set(after) - set(before))]
    found: list[Difference] = []
    for name in sorted(set(before) & set(after)):
        old_one, new_one = before[name], after[name]
        changed = changes(name, points(_report(old_one)), points(_report(new_one)))
        why = tuple(_decisive(old_one, new_one)) if changed else ()
        found += [replace(each, why=why) for each in changed]
    return found, alone


def _gradings(folder: Path) -> dict[str, Path]:
    """Return the folders of gradings by submission; a single grading has the name ""."""
    if (folder / CLASS).is_file():
        entries = ClassFolder(folder).facts().entries
        return {e.id: path for e in entries if (path := folder / SUBMISSIONS / e.id).is_dir()}
    if (folder / DATA).is_file():
        return {"": folder}
    raise GraderError(f"{folder} is neither a class nor a grading: it has no {CLASS} and no {DATA}.")


def points(report: Mapping[str, Any]) -> dict[str, str]:
    """Return the points of a report.json by requirement, in words; those without any are left out."""
    return {
        each["id"]: "withheld" if each["outcome"] == "withheld" else str(rounded(each["points"]))
        for each in report.get("requirements", ())
        if each["max"] or each["outcome"] == "withheld"
    }


def changes(name: str, before: Mapping[str, str], after: Mapping[str, str]) -> list[Difference]:
    """Return the requirements of a submission whose points differ."""
    every = dict.fromkeys([*before, *after])
    pairs = [(each, before.get(each, "none"), after.get(each, "none")) for each in every]
    return [Difference(name, *pair) for pair in pairs if pair[1] != pair[2]]


def _report(folder: Path) -> dict[str, Any]:
    try:
        return data.read(folder / DATA)
    except (OSError, ValueError) as error:
        raise GraderError(f"{folder / DATA} cannot be read ({error}). Grade the submission again.") from error


def _decisive(old: Path, new: Path) -> Iterator[str]:
    """Return what differs of all that decides points; "nothing that is recorded" would be a flicker."""
    first, second = _report(old), _report(new)
    origins = [_origin(folder) for folder in (old, new)]
    differs = [
        ("the input", first.get("sha256") != second.get("sha256")),
        ("the rubric", first.get("rubric") != second.get("rubric")),
        ("the seed", first.get("seed") != second.get("seed")),
        ("the kit", origins[0].get("kit") != origins[1].get("kit")),
        ("the checks", first.get("checks") != second.get("checks")),
        ("the evidence", _evidence_hash(old) != _evidence_hash(new)),
    ]
    names = [name for name, differ in differs if differ]
    yield from names or ["nothing that is recorded"]


def _origin(folder: Path) -> dict[str, str]:
    try:
        found = json.loads((folder / EVIDENCE / "origin.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return found if isinstance(found, dict) else {}


def _evidence_hash(folder: Path) -> str:
    digest = hashlib.sha256()
    for path in sorted((folder / EVIDENCE).rglob("*.json")):
        if path.name != "origin.json":
            digest.update(f"{path.relative_to(folder)}\0".encode() + path.read_bytes())
    return digest.hexdigest()
