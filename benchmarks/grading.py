"""Measure what a grading takes, whole and in parts, collected anew and with nothing changed since.

    python -m benchmarks.grading [--rounds N] [--package FOLDER] [--quick]

CPU seconds are those of the whole machine, because what runs in a sandbox is killed in the end and so in no parent's
books: let nothing else run. Builds come from the cache.
"""

from __future__ import annotations

import argparse
import os
import statistics
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from benchmarks.sandbox_cost import REFERENCE
from grader import building, pipeline
from grader.scoring import rubric
from grader.settings import Reuse

_PARTS = {
    "whole": (), "F and I": ("F", "I"), "Q": ("Q",), "T1 and T2": ("T1", "T2"), "T3": ("T3",),
}  # fmt: skip
_QUICK = ("I2",)


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


def grade(package: Path, wanted: Sequence[str], *, fresh: bool) -> Cost:
    """Grade the requirements whose ids begin with one of `wanted`, all if it is empty, and return what that took."""
    whole = rubric.load(rubric.RUBRIC)
    ids = tuple(r.id for r in whole.requirements if r.id in wanted or r.id[0] in wanted)
    settings = pipeline.Settings(whole, building.cache_folder(), reuse=Reuse.unless(fresh))
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
