"""Validate a notebook's stored outputs with nbval, in a workspace of its own, and read what it found."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path

from grader.authoring import notebook_run
from helpers.notebook_rooms import room as open_room

# What may differ although the notebook is right; the places of this machine come on top.
HARMLESS = (
    (r"base64,[A-Za-z0-9+/=\s]+", "base64,PICTURE"),  # pictures within HTML; pictures on their own nbval leaves out
    (r"\x1b\[[0-9;]*m", ""),
    (r"</?[a-z][^<>]*>", ""),  # HTML without its tags: what it says counts, and plain text stands beside it
)

# nbval runs cells outside the history, where IPython looks for the semicolon that keeps a value from being shown.
SEMICOLONS = """
def note(info):
    if not info.store_history:
        get_ipython().history_manager.input_hist_parsed.append(info.raw_cell)

get_ipython().events.register("pre_run_cell", note)
"""


@dataclass(frozen=True)
class Validation:
    """What nbval found: how many cells it ran, which of them did not do what the stored notebook shows."""

    cells: int
    problems: tuple[str, ...]


def validate(path: Path, cell_seconds: float = notebook_run.CELL_SECONDS) -> Validation:
    """Run the notebook `path` in an empty workspace and compare every output with the stored one."""
    with open_room() as room:
        workspace, sanitize, report = room / "ws", room / "sanitize.cfg", room / "report.xml"
        patterns = (*notebook_run.path_patterns(workspace), *HARMLESS)
        sanitize.write_text(
            "".join(f"[{i}]\nregex: {a}\nreplace: {b}\n\n" for i, (a, b) in enumerate(patterns, start=1))
        )
        (room / "pytest.ini").write_text("[pytest]\n")  # else it would take ours
        (room / "notebooks").mkdir()
        environment = notebook_run.environment(workspace)
        startup = Path(environment["IPYTHONDIR"]) / "profile_default" / "startup"
        startup.mkdir(parents=True)
        (startup / "semicolons.py").write_text(SEMICOLONS)
        shutil.copy(path, room / "notebooks")
        ran = subprocess.run(
            [
                sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "--color=no",
                "-c", str(room / "pytest.ini"), "--rootdir", str(room), "--junit-xml", str(report),
                "--nbval", "--nbval-current-env", "--nbval-sanitize-with", str(sanitize),
                "--nbval-cell-timeout", str(cell_seconds), f"notebooks/{path.name}",
            ],
            cwd=room, env=environment, capture_output=True, text=True, check=False,
        )  # fmt: skip
        if not report.exists():
            return Validation(0, (f"nbval did not run:\n{ran.stdout[-2000:]}{ran.stderr[-2000:]}",))
        return _read(report)


def _read(report: Path) -> Validation:
    cases = list(ET.parse(report).getroot().iter("testcase"))
    problems = [
        f"{case.get('name')}: {without_colour(found.text or found.get('message') or '')}"
        for case in cases
        for found in case
        if found.tag in ("failure", "error", "skipped")
    ]
    return Validation(len(cases), tuple(problems))


def without_colour(text: str) -> str:
    return re.sub(r"(\x1b|#x1B)\[[0-9;]*m", "", text)
