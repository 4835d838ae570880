"""Render a grading, or a refusal to grade, for people and programs: console, HTML, JSON. Nothing is judged here."""

from __future__ import annotations

from pathlib import Path

from grader.report.data import write_json
from grader.report.html import write_html
from grader.report.standing import DATA, Standing, fingerprint, standing
from grader.scoring.grading import Grading, Refusal

__all__ = ["PAGE", "Grading", "Refusal", "Standing", "fingerprint", "standing", "write"]

PAGE = "report.html"


def write(result: Grading | Refusal, folder: Path, *, pictures: bool = True) -> tuple[Path, Path]:
    """Write report.json and report.html into `folder` and return their paths."""
    as_json, as_html = folder / DATA, folder / PAGE
    write_json(result, as_json)
    write_html(result, as_html, pictures=pictures)
    return as_json, as_html
