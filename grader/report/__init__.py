"""Render a grading, or a refusal to grade, for people and programs: console, HTML, JSON. Nothing is judged here."""

from __future__ import annotations

import contextlib
import re
import shutil
from pathlib import Path

from grader.host.atomic import write_atomically
from grader.report import for_students
from grader.report.data import DATA, fingerprint, of_another, write_json
from grader.scoring.grading import Grading, HandIn, Refusal

PAGE = "report.html"
EVIDENCE = "evidence"
"""The folder of the evidence, below that of the reports."""


def write(
    result: Grading | Refusal, folder: Path, *, hand_in: HandIn | None = None, pictures: bool = True
) -> tuple[Path, Path]:
    """Write report.json and report.html into `folder` and return their paths.

    `hand_in` is what a class knows of the submission. Without `pictures` nothing reveals the layout of held-out
    trials; with them, each trial in which points were lost gets an MCAP file beside its evidence, if that is there.
    Where a course holds something back, the folder for_student/ gets the same two reports without it.
    """
    from grader.report import html  # draws with numpy and the simulator: 0.2 s that a check need not wait for

    as_json, as_html = folder / DATA, folder / PAGE
    write_json(result, as_json, hand_in)
    bags = _write_bags(result, folder / EVIDENCE / "trials") if pictures and isinstance(result, Grading) else set()
    write_atomically(as_html, html.render(result, hand_in, pictures=pictures, bags=bags))
    own = folder / for_students.FOLDER
    shutil.rmtree(own, ignore_errors=True)
    if isinstance(result, Grading) and for_students.holds_back(result):
        own.mkdir()
        write_json(theirs := for_students.for_students(result), own / DATA, hand_in)
        write_atomically(own / PAGE, html.render(theirs, hand_in, pictures=pictures))
    return as_json, as_html


def for_student(folder: Path, name: str) -> Path:
    """Return the file `name` of a report in `folder` that its student may read."""
    own = folder / for_students.FOLDER / name
    return own if own.exists() else folder / name


def _write_bags(grading: Grading, folder: Path) -> set[str]:
    """Write the MCAP files that are not there yet, and return the names of all trials that have one."""
    from grader.report import figures

    for trial in figures.failed_trials(grading):
        path = folder / f"{trial.name}.mcap"
        # Only beside its evidence; and whatever a trial holds, the grade must be shown.
        if re.fullmatch(r"\w+", trial.name) and path.with_suffix(".json").is_file() and not path.exists():
            with contextlib.suppress(Exception):
                from grader.report import recording

                recording.write_bag(trial, path)
    return {path.stem for path in folder.glob("*.mcap")}
