"""Reports of made-up gradings, for the tests of a class."""

from __future__ import annotations

from typing import Any

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
