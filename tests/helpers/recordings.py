"""Recorded evidence: one compressed JSON file for each submission, in tests/evidence."""

from __future__ import annotations

import json
import lzma
from functools import cache
from pathlib import Path
from typing import Any

from grader import KIT
from grader.evidence import Evidence, from_json, to_json

FOLDER = KIT / "tests" / "evidence"
_WALL_TIMES = ("wall_seconds", "quiet_seconds")
_GONE = (
    "is_about_package", "left_out", "named_in", "literals", "suppressions", "possible", "budget_seconds", "type_hash",
    "answered_t", "generates_interfaces",
)  # fmt: skip
"""Fields that evidence no longer has, and older recordings do."""


def names(folder: Path = FOLDER) -> set[str]:
    """Return the submissions whose evidence is recorded."""
    return {path.name.removesuffix(".json.xz") for path in folder.glob("*.json.xz")}


def save(evidence: Evidence, name: str, folder: Path = FOLDER) -> None:
    """Write the evidence without what differs from run to run: wall times, and the machine it was made on."""
    facts = _without_wall_times(json.loads(to_json(evidence)))
    write(folder / f"{name}.json.xz", json.dumps(facts | {"origin": {}}))


@cache
def load(name: str, folder: Path = FOLDER) -> Evidence:
    """Return the evidence recorded of a submission.

    Raises:
        AssertionError: there is none, or the classes of grader.evidence have changed since; the message names the
            command that records it again.
    """
    try:
        return from_json(json.dumps(_without_gone(json.loads(read(folder / f"{name}.json.xz")))), Evidence)
    except (OSError, lzma.LZMAError, ValueError) as error:
        again = f"PYTHONPATH=.:tests python -m submissions.record {name}"
        raise AssertionError(f"The evidence of {name} cannot be read: {error}. Record it again: {again}") from error


def read(path: Path) -> str:
    """Return the JSON text of a recording."""
    return lzma.decompress(path.read_bytes()).decode()


def write(path: Path, text: str) -> None:
    """Write the JSON text of a recording."""
    path.write_bytes(lzma.compress(text.encode(), preset=9 | lzma.PRESET_EXTREME))


def _without_gone(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _without_gone(item) for key, item in value.items() if key not in _GONE}
    return list(map(_without_gone, value)) if isinstance(value, list) else value


def _without_wall_times(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: 0.0 if key in _WALL_TIMES else _without_wall_times(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_without_wall_times(item) for item in value]
    return value
