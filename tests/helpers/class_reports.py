"""What the tests of a class share: reports of made-up gradings, and somebody who hears how a run goes on."""

from __future__ import annotations

from typing import Any

from grader.classroom.batch import Progress
from grader.classroom.class_folder import Record
from grader.scoring import rubric


def report(lost: dict[str, float] | None = None, **more: Any) -> dict[str, Any]:
    """Return a report.json in which all points are reached but those `lost`, by requirement."""
    lost = lost or {}
    requirements = [
        {
            "id": requirement.id,
            "points": requirement.points - lost.get(requirement.id, 0.0),
            "max": requirement.points,
            "outcome": "partial" if requirement.id in lost else "passed",
            "seen": "touched it at 7.3 s" if requirement.id in lost else "",
            "checks": [
                {
                    "id": check.id,
                    "sentence": "stops before the wall",
                    "outcome": "failed" if requirement.id in lost else "passed",
                    "seen": "touched it at 7.3 s\n::error::forged, 100 %",
                    "expected": "no contact",
                    "try": "",
                    "because": "",
                }
                for check in requirement.checks[:1]
            ],
        }
        for requirement in rubric.load(rubric.RUBRIC).requirements
    ]
    return {"submission": "team07.zip", "requirements": requirements, "integrity": [], "wall_seconds": 41.25} | more


class Silent:
    """Hears how a run goes on and keeps it."""

    def __init__(self) -> None:
        self.records: list[Record] = []
        self.left: list[float | None] = []

    def finished(self, record: Record, progress: Progress) -> None:
        self.records.append(record)
        self.left.append(progress.left_s)

    def going_on(self, progress: Progress) -> None:
        pass
