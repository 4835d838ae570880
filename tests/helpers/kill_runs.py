"""Kill gradings with SIGKILL at random moments, look for what they leave, and grade again in the same folder.

Run it:  PYTHONPATH=.:tests python tests/helpers/kill_runs.py 100
"""

from __future__ import annotations

import contextlib
import ctypes
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from grader import KIT, building, evidence, pipeline, report
from grader.course import kits_own
from grader.host import procfs
from grader.scoring import rubric

REFERENCE = KIT / "solution_pkg" / "ros2_robot_controller"
ONLY = ("F1", "F14", "I5", "T1")
_SUBREAPER = 36  # prctl: orphaned descendants become our children, so none can escape
_LEFT_S = 10.0


def start(out: Path) -> subprocess.Popen[bytes]:
    """Start a grading in a process of its own."""
    command = [sys.executable, "-P", __file__, str(out)]
    return subprocess.Popen(command, cwd=KIT, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)


def grade(out: Path) -> None:
    """Grade the reference in this process."""
    course = kits_own()
    settings = pipeline.Settings(rubric.load(course.rubric), building.cache_folder(), course, requirements=ONLY)
    pipeline.grade(REFERENCE, out, settings, write=report.write)


def children() -> list[int]:
    """Return the ids of our child processes that are still running."""
    return [pid for pid in procfs.children(os.getpid()) if procfs.runs(pid)]


def reap() -> None:
    """Reap the dead among the processes that we have inherited."""
    with contextlib.suppress(ChildProcessError):
        while os.waitpid(-1, os.WNOHANG)[0]:
            pass


def kill_once(out: Path, after: float) -> list[str]:
    """Kill a grading after `after` seconds and return what it should not have left."""
    ctypes.CDLL(None).prctl(_SUBREAPER, 1, 0, 0, 0)
    mounts = Path("/proc/mounts").read_text()
    grading = start(out)
    with contextlib.suppress(subprocess.TimeoutExpired):
        grading.wait(after)
    with contextlib.suppress(ProcessLookupError):
        os.kill(grading.pid, signal.SIGKILL)
    grading.wait()
    assert grading.stderr is not None
    grading.stderr.close()
    deadline = time.monotonic() + _LEFT_S
    while children() and time.monotonic() < deadline:
        time.sleep(0.02)
        reap()
    wrong = [f"a process is left: {left}" for left in children()]
    reap()
    if Path("/proc/mounts").read_text() != mounts:
        wrong.append("a mount is left")
    return wrong + unreadable(out)


def unreadable(out: Path) -> list[str]:
    """Return which results are incomplete."""
    wrong = []
    with contextlib.suppress(FileNotFoundError):
        try:
            json.loads((out / "report.json").read_text())
        except ValueError:
            wrong.append("report.json is half written")
    if (out / "evidence").exists():
        try:
            evidence.load(out / "evidence")
        except (OSError, ValueError) as error:
            wrong.append(f"the evidence is half written: {error}")
    return wrong


def grade_again(out: Path) -> tuple[dict[str, float], list[str]]:
    """Grade in the same folder; return the points and the problems."""
    grading = start(out)
    _, errors = grading.communicate()
    if grading.returncode:
        return {}, [f"the second run failed with status {grading.returncode}: {errors.decode()[-500:]}"]
    requirements = json.loads((out / "report.json").read_text())["requirements"]
    points = {r["id"]: r["points"] for r in requirements if r["id"] in ONLY}
    left = sorted(path.name for path in out.iterdir() if path.name.startswith("."))
    return points, [f"{', '.join(left)} is left"] if left else []


def main(runs: int) -> int:
    """Kill gradings, print what each left, grade again after every tenth, and return 1 if anything was wrong."""
    bad = 0
    with tempfile.TemporaryDirectory(prefix="kill-") as folder:
        out, began = Path(folder) / "out", time.monotonic()
        expected, wrong = grade_again(out)
        whole = time.monotonic() - began
        for number in range(1, runs + 1):
            after = random.Random(number).uniform(0.0, whole)
            wrong += kill_once(out, after)
            if number % 10 == 0 or number == runs:
                points, more = grade_again(out)
                wrong += more + ([f"the next run gave {points}, not {expected}"] if points != expected else [])
            print(f"kill {number:>3} of {runs} after {after:>5.1f} s: {'; '.join(wrong) or 'nothing left'}", flush=True)
            bad += bool(wrong)
            wrong = []
    return 1 if bad else 0


if __name__ == "__main__":
    if sys.argv[1].isdecimal():
        sys.exit(main(int(sys.argv[1])))
    grade(Path(sys.argv[1]))
