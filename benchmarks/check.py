"""Measure how long a student waits for `check` in a notebook: anew, after an edit, and with nothing changed.

    python -m benchmarks.check [--rounds N] [--quick]

CPU seconds are those of the whole machine: let nothing else run.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import os
import shutil
import statistics
import tempfile
import time
from pathlib import Path

from benchmarks.grading import cpu_s
from benchmarks.sandbox_cost import REFERENCE
from grader.notebook import checking
from grader.notebook.workspace import Workspace

_NODE, _TEST = "ros2_robot_controller/driver.py", "test/test_robot_controller.py"
# What is asked for, and the file that is edited between two checks.
_CHECKS = {
    "F2": _NODE, "F4": _NODE, "F8": _NODE, "I5": _NODE, "I8": _NODE, "Q1": _NODE, "Q4": _NODE,
    "T1 T2": _TEST, "T3": _TEST, "T1 T2 T3": _TEST,
}  # fmt: skip

_EDIT_S = 2.0  # nobody edits a file faster, and meanwhile the process for the next check starts


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__.splitlines()[0], epilog="example: python -m benchmarks.check --rounds 3"
    )
    parser.add_argument("--rounds", type=int, default=3, help="how often to measure (default %(default)s)")
    parser.add_argument("--quick", action="store_true", help="once, one requirement that needs no run")
    options = parser.parse_args()
    rounds, checks = (1, {"Q1": _NODE}) if options.quick else (options.rounds, _CHECKS)
    print(f"The reference, median of {rounds}, load at the start {os.getloadavg()[0]:.1f}\n")
    print("| check | anew, wall s | CPU s | after an edit, wall s | CPU s | unchanged, wall s | CPU s | all pass |")
    print("|---|--:|--:|--:|--:|--:|--:|---|")
    with tempfile.TemporaryDirectory() as folder:
        workspace = Workspace(Path(folder))
        shutil.copytree(REFERENCE, workspace.package)
        for asked, edited in checks.items():
            found = [_measure(workspace, asked.split(), edited) for _ in range(rounds)]
            figures = [statistics.median(column) for column in zip(*(times for times, _ in found), strict=True)]
            passed = all(passed for _, passed in found)
            print(f"| {asked} | {' | '.join(f'{each:.1f}' for each in figures)} | {passed} |", flush=True)


def _measure(workspace: Workspace, asked: list[str], edited: str) -> tuple[list[float], bool]:
    """Return wall and CPU seconds of a check anew, after an edit and unchanged, and whether all of them passed."""
    seconds: list[float] = []
    passed = True
    for way in ("anew", "after an edit", "unchanged"):
        if way == "after an edit":
            time.sleep(_EDIT_S)
            with (workspace.package / edited).open("a") as file:
                file.write(f"# {time.time_ns()}\n")  # no build of it is in the cache
        began, used = time.monotonic(), cpu_s()
        with contextlib.redirect_stdout(io.StringIO()):
            checked = checking.check(workspace, asked, fresh=way == "anew")
        seconds += [time.monotonic() - began, cpu_s() - used]
        passed = passed and all(answer.passed for answer in checked.answers)
    return seconds, passed


if __name__ == "__main__":
    main()
