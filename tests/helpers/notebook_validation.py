"""Compare a notebook's stored outputs with those of a new run, with nbval."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path

from grader.authoring import notebook_run
from grader.notebook.workspace import FRESH

# Parts of an output that may differ in a correct notebook, besides the paths of this machine.
HARMLESS = (
    (r"base64,[A-Za-z0-9+/=\s]+", "base64,PICTURE"),  # pictures in HTML; nbval itself ignores other pictures
    (r"\x1b\[[0-9;]*m", ""),
    (r"holds \d+ files", "holds FILES"),  # a notebook leaves files that start_at does not lay out
    # Which mutants fit into the seconds of a check, and which test is the first to notice, depends on the machine.
    (r"(?s)\d+ of \d+ mutants were noticed, [\d.]+ .(;[^<]*?used\s+up)?", "MUTANTS"),
    (r"a sample: \d+ of \d+ mutants tried", "a sample: N mutants tried"),
    # While a node gives no feedback yet, its goals are run in real time, and no two such runs are the same.
    (r"final_pose at \([^)]*\), 0 feedback", "final_pose at PLACE, 0 feedback"),
    (r"Nothing has changed since [^\n<]*\n?", ""),  # evidence kept of the same package, collected by the same code
    (r"</?[a-z][^<>]*>", ""),  # HTML tags: the text counts, and the plain text is compared too
)

# In a shorter lane the course has written files before the first cell, and a function that a later cell asks for.
IN_A_SHORTER_LANE = (
    (r"Lane: core[^\n]*\n", ""),
    (r"holds (no|\d+) files", "holds FILES"),
    (r"final_pose at \([^)]*\), \d+ feedback", "final_pose at PLACE, N feedback"),
    (r"(?s)> \d\d .*Words and commands: \S+", "PANEL"),  # it shows what the lane asks for
    (r'(?s)<div style="max-width:62em;.*</div>', "PANEL"),
)

# IPython looks in the history for the semicolon that suppresses a value, and nbval runs cells outside the history.
SEMICOLONS = """
def note(info):
    if not info.store_history:
        get_ipython().history_manager.input_hist_parsed.append(info.raw_cell)

get_ipython().events.register("pre_run_cell", note)
"""


@dataclass(frozen=True)
class Validation:
    """nbval's result: the number of cells it ran, and one text for each cell that differs from the stored notebook."""

    cells: int
    problems: tuple[str, ...]


def validate(
    path: Path,
    workspace: Path,
    cell_seconds: float = notebook_run.CELL_SECONDS,
    *,
    may_differ: tuple[tuple[str, str], ...] = (),
) -> Validation:
    """Run the notebook `path` in a workspace and compare every output with the stored one.

    Its checks take evidence that is kept of the same package, as they do for a student.
    """
    with tempfile.TemporaryDirectory(prefix="nbval-") as scratch:
        folder = Path(scratch)
        sanitize, report = folder / "sanitize.cfg", folder / "report.xml"
        patterns = (*may_differ, *notebook_run.path_patterns(workspace), *HARMLESS)
        sanitize.write_text(
            "".join(f"[{i}]\nregex: {a}\nreplace: {b}\n\n" for i, (a, b) in enumerate(patterns, start=1))
        )
        (folder / "pytest.ini").write_text("[pytest]\n")  # or pytest would use ours
        (folder / "notebooks").mkdir()
        environment = notebook_run.environment(workspace)
        del environment[FRESH]
        startup = Path(environment["IPYTHONDIR"]) / "profile_default" / "startup"
        (startup / "semicolons.py").write_text(SEMICOLONS)
        shutil.copy(path, folder / "notebooks")
        ran = subprocess.run(
            [
                sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "--color=no",
                "-c", str(folder / "pytest.ini"), "--rootdir", str(folder), "--junit-xml", str(report),
                "--nbval", "--nbval-current-env", "--nbval-sanitize-with", str(sanitize),
                "--nbval-cell-timeout", str(cell_seconds), f"notebooks/{path.name}",
            ],
            cwd=folder, env=environment, capture_output=True, text=True, check=False,
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
