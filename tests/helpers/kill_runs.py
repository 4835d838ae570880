"""Kill gradings with SIGKILL at random moments, look for what they leave, and grade again in the same folder.

Run it:  PYTHONPATH=.:tests python tests/helpers/kill_runs.py --runs 100 [--only F1 F14 T1]
"""

from __future__ import annotations

import argparse
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
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from grader import KIT, evidence

ROOT = KIT
REFERENCE = ROOT / "solution_pkg" / "ros2_robot_controller"
_SUBREAPER = 36  # prctl: orphaned descendants become our children, so none can escape
_LEFT_S = 10.0


def start(out: Path, only: list[str], package: Path = REFERENCE) -> subprocess.Popen[bytes]:
    """Start a grading in a process of its own."""
    command = [sys.executable, "-m", "grader.selftest.flakiness", str(package), str(out), ",".join(only)]
    return subprocess.Popen(command, cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)


def children() -> list[str]:
    """Return the ids and names of our child processes that are still running."""
    found = []
    for entry in Path("/proc").iterdir():
        with contextlib.suppress(OSError, ValueError):
            if entry.name.isdigit():
                head, _, rest = (entry / "stat").read_text().rpartition(")")
                if int(rest.split()[1]) == os.getpid() and rest.split()[0] != "Z":
                    found.append(f"{entry.name} {head.partition('(')[2]}")
    return found


def reap() -> None:
    """Reap the dead among the processes that we have inherited."""
    with contextlib.suppress(ChildProcessError):
        while os.waitpid(-1, os.WNOHANG)[0]:
            pass


def kill_once(out: Path, only: list[str], after: float) -> list[str]:
    """Kill a grading after `after` seconds and return what it should not have left."""
    ctypes.CDLL(None).prctl(_SUBREAPER, 1, 0, 0, 0)
    mounts = Path("/proc/mounts").read_text()
    grading = start(out, only)
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


def grade_again(out: Path, only: list[str]) -> tuple[dict[str, float], list[str]]:
    """Grade in the same folder; return the points and the problems."""
    grading = start(out, only)
    _, errors = grading.communicate()
    if grading.returncode:
        return {}, [f"the second run failed with status {grading.returncode}: {errors.decode()[-500:]}"]
    report = json.loads((out / "report.json").read_text())
    points = {r["id"]: r["points"] for r in report["requirements"] if r["id"] in only}
    left = sorted(path.name for path in out.iterdir() if path.name.startswith("."))
    return points, [f"{', '.join(left)} is left"] if left else []


@dataclass(frozen=True)
class Kill:
    """One killed grading: its number, when it was killed, in seconds, and what was wrong after it."""

    number: int
    after: float
    wrong: list[str]


def kills(out: Path, options: argparse.Namespace) -> Iterator[Kill]:
    """Yield each killed grading."""
    began = time.monotonic()
    expected, wrong = grade_again(out, options.only)
    whole = time.monotonic() - began
    for number in range(options.runs):
        after = random.Random(f"{options.seed}:{number}").uniform(0.0, whole)
        wrong += kill_once(out, options.only, after)
        if number % options.again_every == options.again_every - 1 or number == options.runs - 1:
            points, more = grade_again(out, options.only)
            wrong += more + ([f"the next run gave {points}, not {expected}"] if points != expected else [])
        yield Kill(number, round(after, 1), wrong)
        wrong = []


def row(kill: Kill, runs: int) -> str:
    """Return a kill's line in the table."""
    return f"kill {kill.number + 1:>3} of {runs} after {kill.after:>5.1f} s: {'; '.join(kill.wrong) or 'nothing left'}"


def main(arguments: list[str] | None = None) -> int:
    """Kill gradings, report each, and return 1 if there was any problem."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=10, help="how many gradings to kill (default 10)")
    parser.add_argument("--only", nargs="+", default=["F1", "F14", "I5", "T1"], help="requirements to grade")
    parser.add_argument("--seed", type=int, default=0, help="seed of the random moments")
    parser.add_argument("--again-every", type=int, default=10, help="grade fully after this many kills (default 10)")
    options = parser.parse_args(arguments)
    bad = 0
    with tempfile.TemporaryDirectory(prefix="kill-") as folder:
        for kill in kills(Path(folder) / "out", options):
            print(row(kill, options.runs), flush=True)
            bad += bool(kill.wrong)
    print(f"{options.runs} gradings were killed; {bad} left something behind or spoilt the next one.")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
