"""Measure what a grading takes, whole and in parts, collected anew and with nothing changed since.

    python -m benchmarks.grading [--rounds N] [--package FOLDER] [--quick]

CPU seconds are those of the whole machine, because what runs in a sandbox is killed in the end and so in no parent's
books: let nothing else run. Builds come from the cache. A second table says which processes of the whole grading have
used them, by looking at all of them twenty times a second.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import re
import statistics
import tempfile
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Self

from benchmarks.sandbox_cost import REFERENCE
from grader import building, pipeline
from grader.host import procfs
from grader.scoring import rubric
from grader.settings import Reuse

_PARTS = {
    "whole": (), "F and I": ("F", "I"), "Q": ("Q",), "T1 and T2": ("T1", "T2"), "T3": ("T3",),
}  # fmt: skip
_QUICK = ("I2",)
_LOOK_S = 0.05
_MUTANTS, _OWN_TESTS = "mutants (T3)", "own tests (T1, T2)"
_KINDS = {
    "observers with the simulator": r"grader\.trials\.worker",
    "launch files": r"/ws/ros2",
    "nodes": r"/ws/install/|fork_nodes",
    _OWN_TESTS: r"/ws/worker/worker\.py",
    "linters": r"flake8|pycodestyle|pydocstyle|ruff",
    "reading the text": r"grader\.quality",
    "checks": r"grader\.checks",
    "builds": r"colcon|cmake|ninja|/ws/build",
    "sandboxes": r"bwrap|proot",
}
"""Kinds of processes, by their command lines; the first that fits counts."""


@dataclass(frozen=True)
class Cost:
    """What a grading took, in seconds of wall time and of the machine's CPU time, and its points."""

    wall_s: float
    cpu_s: float
    points: float


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__.splitlines()[0], epilog="example: python -m benchmarks.grading --rounds 3"
    )
    parser.add_argument("--rounds", type=int, default=3, help="how often to measure (default %(default)s)")
    parser.add_argument("--package", type=Path, default=REFERENCE, help="a package (default: the reference)")
    parser.add_argument("--quick", action="store_true", help="once, one requirement that needs no run")
    options = parser.parse_args()
    parts = {"I2": _QUICK} if options.quick else _PARTS
    rounds = 1 if options.quick else options.rounds
    package = options.package.resolve()
    grade(package, _QUICK if options.quick else ("F4",), fresh=True)  # what is built once is built now
    print(f"{package.name}, median of {rounds}, load at the start {os.getloadavg()[0]:.1f}\n")
    print("| requirements | wall s | CPU s | unchanged, wall s | CPU s | points |")
    print("|---|--:|--:|--:|--:|--:|")
    for name, wanted in parts.items():
        anew = [grade(package, wanted, fresh=True) for _ in range(rounds)]
        again = [grade(package, wanted, fresh=False) for _ in range(rounds)]
        figures = [
            f"{statistics.median(values):.1f}"
            for costs in (anew, again)
            for values in ([cost.wall_s for cost in costs], [cost.cpu_s for cost in costs])
        ]
        points = sorted({f"{cost.points:g}" for cost in anew + again})
        print(f"| {name} | {' | '.join(figures)} | {', '.join(points)} |", flush=True)
    with Accounts() as accounts:
        whole = grade(package, next(iter(parts.values())), fresh=True, progress=accounts.note)
    print(f"\n| processes of one grading on {next(iter(parts))} | CPU s |\n|---|--:|")
    for kind, used in sorted(accounts.of_kinds().items(), key=lambda row: -row[1]):
        print(f"| {kind} | {used:.1f} |")
    print(f"| rest, and what ended between two looks | {whole.cpu_s - sum(accounts.of_kinds().values()):.1f} |")


class Accounts(threading.Thread):
    """Looks at all processes of this one while its block runs, and adds up what each kind of them has used."""

    def __init__(self) -> None:
        super().__init__(daemon=True)
        self._over, self._mutating = threading.Event(), False
        self._used: dict[int, float] = {}
        self._kinds: dict[int, str] = {}

    def __enter__(self) -> Self:
        """Begin."""
        self._before = time.process_time()
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        """End."""
        self._over.set()
        self.join()
        self._own = time.process_time() - self._before

    def note(self, what: str) -> None:
        """Note what a grading says that it does: own tests and mutants have the same command line."""
        self._mutating = self._mutating or what.startswith("mutating")

    def run(self) -> None:
        """Look until the block ends."""
        while not self._over.wait(_LOOK_S):
            for pid in procfs.descendants_at_a_glance(os.getpid()):
                with contextlib.suppress(OSError):  # it has just ended
                    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
                    self._used[pid] = (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
                    words = Path(f"/proc/{pid}/cmdline").read_bytes().replace(b"\0", b" ").decode("utf-8", "replace")
                    self._kinds[pid] = self._kind(words, self._kinds.get(pid, ""))

    def _kind(self, words: str, known: str) -> str:
        """Return a process's kind: it may be seen first as a copy of its parent."""
        kind = next((kind for kind, pattern in _KINDS.items() if re.search(pattern, words)), "")
        if kind == _OWN_TESTS and self._mutating and known != _OWN_TESTS:
            return _MUTANTS
        return kind or known or "rest"

    def of_kinds(self) -> dict[str, float]:
        """Return the CPU seconds of each kind, and of this process."""
        found = {"the grader's own process": self._own}
        for pid, used in self._used.items():
            found[self._kinds[pid]] = found.get(self._kinds[pid], 0.0) + used
        return {kind: used for kind, used in found.items() if kind != "rest"}


def grade(
    package: Path, wanted: Sequence[str], *, fresh: bool, progress: Callable[[str], None] = lambda _what: None
) -> Cost:
    """Grade the requirements whose ids begin with one of `wanted`, all if it is empty, and return what that took."""
    whole = rubric.load(rubric.RUBRIC)
    ids = tuple(r.id for r in whole.requirements if r.id in wanted or r.id[0] in wanted)
    settings = pipeline.Settings(whole, building.cache_folder(), reuse=Reuse.unless(fresh), progress=progress)
    with tempfile.TemporaryDirectory() as folder:
        began, used = time.monotonic(), cpu_s()
        grading = pipeline.grade(package, Path(folder), replace(settings, requirements=ids))
        return Cost(time.monotonic() - began, cpu_s() - used, grading.scorecard.points)


def cpu_s() -> float:
    """Return the CPU time that the machine has used since it started. See proc(5), /proc/stat."""
    user, nice, system, _idle, _waiting, *interrupts = map(
        int, Path("/proc/stat").read_text().split("\n")[0].split()[1:8]
    )
    return (user + nice + system + sum(interrupts)) / os.sysconf("SC_CLK_TCK")


if __name__ == "__main__":
    main()
