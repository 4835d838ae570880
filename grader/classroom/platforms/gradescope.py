"""Gradescope: results.json of an autograder (gradescope/autograder_samples, docs/specs.md)."""

from __future__ import annotations

import datetime as dt
import json
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import yaml

from grader.classroom import platform
from grader.classroom.gradebook import Row, State
from grader.classroom.identity import Claim
from grader.classroom.platform import Delivery, Export, HandIn, Lost, Platform
from grader.errors import GraderError
from grader.host.tempdir import write_atomically
from grader.scoring.rubric import FLAGS, Rubric

_METADATA = "submission_metadata.yml"


def results(row: Row, rubric: Rubric, report: dict[str, Any]) -> dict[str, Any]:
    """Return what results.json says: a test for each requirement that has points; `report` is empty without a grade."""
    numbers = {
        requirement.id: f"{chapter}.{place}"
        for chapter, criterion in enumerate(rubric.criteria, 1)
        for place, requirement in enumerate(criterion.requirements, 1)
    }
    tests: list[dict[str, object]] = []
    for each, title, lost in platform.judged(row, rubric, report):
        said = f"{each.override.points:g} points by {each.override.by}: {each.override.why}" if each.override else ""
        output = State.WITHHELD.value if each.withheld else "\n".join(filter(None, [said, *lost]))
        test: dict[str, object] = {"name": title, "number": numbers[each.id], "output": output, "visibility": "visible"}
        if each.withheld:
            tests.append(test)
        elif each.points is not None:
            status = "passed" if each.points == each.max else "failed"
            tests.append(test | {"score": float(each.points), "max_score": float(each.max), "status": status})
    seconds = report.get("wall_seconds")
    return {
        "score": float(row.total or 0),  # overrides the sum of the tests: it has the deduction for lateness
        "output": platform.comment(row, rubric) or "Graded.",
        "output_format": "text",
        "test_output_format": "text",
        "visibility": "visible",
        "stdout_visibility": "hidden",
        "tests": tests,
        "extra_data": {
            "state": row.state.value,
            "late": row.late_days,
            "flags": row.flags,
            "flags_do": FLAGS[rubric.withholds],
        },
    } | ({"execution_time": round(seconds, 1)} if isinstance(seconds, int | float) else {})


def _write(delivery: Delivery) -> list[str]:
    """Write ID/results.json for each submission that has points."""
    without = []
    for row in delivery.book.teams.values():
        if row.total is None:
            without.append(f"{row.submission} ({row.state.value})")
            continue
        found = results(row, delivery.book.rubric, delivery.reports.get(row.submission, {}))
        text = json.dumps(found, indent=2, allow_nan=False) + "\n"
        write_atomically(delivery.out / row.submission / "results.json", text)
    return [*delivery.book.apart(), *[f"no points yet, so no results.json: {', '.join(without)}"] * bool(without)]


def _read(root: Path, entries: Sequence[Path]) -> Export:
    """`submission_123/`, and `submission_metadata.yml` with names, e-mails and times."""
    try:
        metadata = yaml.load((root / _METADATA).read_text(encoding="utf-8"), _RubyLoader)
        described = {str(key): _described(value) for key, value in metadata.items()}
    except (OSError, ValueError, AttributeError, TypeError, KeyError, yaml.YAMLError) as error:
        raise GraderError(
            f"{root / _METADATA} is not as Gradescope writes it ({error!r}). Export once more."
        ) from error
    hand_ins, notes = platform.others(entry for entry in entries if entry.name not in (*described, _METADATA))
    for entry in entries:
        if entry.name in described:
            path, remarks = platform.one_of(entry.name, [entry])
            notes += remarks
            known = described[entry.name]
            hand_ins.append(replace(known, path=path, label=known.label or entry.name))
    present = {entry.name for entry in entries}
    lost = [
        Lost(each.label, f"The export lists a submission of {each.label}, but does not hold it.", each.claims)
        for name, each in described.items()
        if name not in present
    ]
    return Export("gradescope", tuple(hand_ins), tuple(notes), tuple(lost))


class _RubyLoader(yaml.SafeLoader):
    """Reads the YAML that a Ruby program wrote: an object of a type of Ruby's is read as what it consists of."""


def _ruby(loader: yaml.SafeLoader, _suffix: str, node: yaml.Node) -> Any:
    if isinstance(node, yaml.MappingNode):
        return loader.construct_mapping(node, deep=True)
    if isinstance(node, yaml.SequenceNode):
        return loader.construct_sequence(node, deep=True)
    return loader.construct_scalar(node) if isinstance(node, yaml.ScalarNode) else None


_RubyLoader.add_multi_constructor("!", _ruby)


def _described(value: dict[str, Any]) -> HandIn:
    kinds = {":sid": "id", ":email": "email", ":name": "name"}
    people = [
        tuple(Claim(kind, str(person[key]).strip()) for key, kind in kinds.items() if person.get(key))
        for person in value[":submitters"]
    ]
    label = ", ".join(str(person.get(":name") or person.get(":email") or "") for person in value[":submitters"])
    return HandIn(Path(), label, tuple(people), _time(value.get(":created_at")))


def _time(value: object) -> dt.datetime | None:
    """Return a time as Ruby writes it: YAML knows "2026-11-20 22:58:01 Z", but not "2026-11-20 22:58:01.5 +0100"."""
    if isinstance(value, str):
        value = dt.datetime.fromisoformat(re.sub(r"\s+(?=[-+ZU])", "", value).replace("UTC", "Z"))
    if isinstance(value, dt.datetime):
        return value if value.tzinfo else value.replace(tzinfo=dt.UTC)
    return None


PLATFORM = Platform(
    "gradescope", "gradescope", "gradescope", lambda root, _: (root / _METADATA).is_file(), _read, _write, (_METADATA,)
)
