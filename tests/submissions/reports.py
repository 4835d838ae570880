"""Read a report as a test wants it."""

from __future__ import annotations

import json
from typing import Any

Graded = dict[str, Any]


def lost(report: Graded) -> set[str]:
    """Return the requirements that have lost points."""
    return {r["id"] for r in report["requirements"] if r["outcome"] != "not_graded" and r["points"] < r["max"]}


def taken(report: Graded) -> dict[str, float]:
    """Return the points that a complete report takes, by requirement."""
    assert report["complete"], words(report)
    return {r["id"]: round(r["max"] - r["points"], 2) for r in report["requirements"] if r["id"] in lost(report)}


def words(report: Graded) -> str:
    """Return everything that the report says of what went wrong."""
    return json.dumps(report["requirements"], ensure_ascii=False)
