"""Render a grading for people and programs: console, HTML, JSON. Nothing is judged here."""

from __future__ import annotations

from pathlib import Path

from grader.report.data import write_json
from grader.report.html import write_html
from grader.scoring.grading import Grading

__all__ = ["PAGE", "Grading", "write"]

DATA, PAGE = "report.json", "report.html"


def write(grading: Grading, folder: Path, *, pictures: bool = True) -> tuple[Path, Path]:
    """Write report.json and report.html into `folder` and return their paths."""
    as_json, as_html = folder / DATA, folder / PAGE
    write_json(grading, as_json)
    write_html(grading, as_html, pictures=pictures)
    return as_json, as_html
