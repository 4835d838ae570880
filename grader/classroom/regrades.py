"""regrades.yaml: requests to look at a requirement again, and what was decided. Lines are only ever added.

    - {submission: team07, requirement: F4, reason: the wall stood in the start, asked: 2026-11-28T10:00+01:00}
    - {submission: team07, requirement: F4, points: 3, why: so it did, by: A. Lovelace, decided: 2026-11-29T09:00+01:00}

A decision without points leaves them as they are. What overrides.yaml says of a requirement goes before what is here.
"""

from __future__ import annotations

import datetime as dt
from collections.abc import Collection
from dataclasses import dataclass, replace
from decimal import Decimal
from pathlib import Path
from typing import Any

import yaml

from grader import yaml_reader
from grader.host.atomic import write_atomically
from grader.scoring.rubric import Rubric
from grader.yaml_reader import YamlReader

FILE = "regrades.yaml"
_HEADER = "# Requests to look at a requirement again, and decisions. `grader regrade` adds lines and changes none.\n"
_REQUEST, _DECISION = ("reason",), ("why", "by")


@dataclass(frozen=True)
class Regrade:
    """One requirement of one submission that is to be looked at again; `by` is "" until it is decided.

    `points` are None while it is open, and where the decision leaves them as they are.
    """

    submission: str
    requirement: str
    reason: str = ""
    points: Decimal | None = None
    why: str = ""
    by: str = ""

    @property
    def is_open(self) -> bool:
        """Return whether it waits for a decision."""
        return not self.by

    def __str__(self) -> str:
        asked = f'{self.requirement} is to be looked at again, because "{self.reason}"'
        if self.is_open:
            return f"{asked}: not decided yet"
        answer = "stays as it is" if self.points is None else f"has {self.points} points"
        decided = f"{self.requirement} {answer} after a second look, by {self.by}: {self.why}"
        return f'{decided} (asked because "{self.reason}")' if self.reason else decided


def read(folder: Path, submissions: Collection[str], rubric: Rubric) -> tuple[Regrade, ...]:
    """Return what the class folder's regrades.yaml says, the last word on each requirement; () without the file.

    Raises:
        GraderError: it cannot be read, or names something that the class or the rubric does not have.
    """
    path = folder / FILE
    root = yaml_reader.read(path) if path.exists() else None
    return _Reader(path, submissions, rubric).read(root) if root is not None else ()


def add(folder: Path, submission: str, requirement: str, **said: object) -> None:
    """Add a line to the class folder's regrades.yaml; `said` is a reason, or points or None, why and by."""
    path = folder / FILE
    time = dt.datetime.now().astimezone().isoformat(timespec="minutes")
    line: dict[str, Any] = {"submission": submission, "requirement": requirement}
    line |= {name: " ".join(str(value).split()) for name, value in said.items() if value is not None}
    line["decided" if "by" in said else "asked"] = time
    earlier = path.read_text(encoding="utf-8") if path.exists() else _HEADER
    text = yaml.safe_dump(line, default_flow_style=True, allow_unicode=True, sort_keys=False, width=float("inf"))
    write_atomically(path, f"{earlier.rstrip()}\n- {text}")


class _Reader(YamlReader):
    def __init__(self, path: Path, submissions: Collection[str], rubric: Rubric) -> None:
        super().__init__(path)
        self._submissions = submissions
        self._worth = {requirement.id: requirement.points for requirement in rubric.requirements}

    def read(self, root: yaml.Node) -> tuple[Regrade, ...]:
        found: dict[tuple[str, str], Regrade] = {}
        for item in self.items(root):
            given = self.fields(
                item, item, ("submission", "requirement"), "a line",
                ("reason", "asked", "points", "why", "by", "decided"),
            )  # fmt: skip
            submission, requirement = self.text(given["submission"]), self.text(given["requirement"])
            self.require_known(submission, given["submission"], self._submissions, "a submission of this class")
            self.require_known(requirement, given["requirement"], self._worth, "a requirement of the rubric")
            known = found.get((submission, requirement), Regrade(submission, requirement))
            if "reason" in given:
                known = Regrade(submission, requirement, self.text(given["reason"]))
            elif missing := [name for name in _DECISION if name not in given]:
                self.fail(item, f"{missing[0]!r} is missing; a line needs {_REQUEST[0]}, or {' and '.join(_DECISION)}")
            else:
                worth = self._worth[requirement]
                points = self.points(given["points"], worth, requirement) if "points" in given else None
                known = replace(known, points=points, why=self.text(given["why"]), by=self.text(given["by"]))
            found[submission, requirement] = known
        return tuple(found.values())
