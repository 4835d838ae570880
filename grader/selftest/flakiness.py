"""Grade a submission many times and report how often each requirement passed: `grader flakiness`.

A requirement that passes only sometimes is an error of the grader's, whatever the submission. Each grading is a process
of its own; with stress, every second one runs with every core loaded and its observers discovering the nodes late.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from grader.course import Course, find, load
from grader.errors import GraderError, UsageError
from grader.scoring import rubric
from grader.trials.request import LATE_VARIABLE

_LATE_S = 1.5
_GRADING_SECONDS = 3600.0
# Ends by itself once the grader has been killed.
_BUSY = "import os\nwhile os.getppid() == {pid}:\n    sum(range(100000))"


@dataclass(frozen=True)
class GradingRun:
    """One grading: its number, whether it was under stress, each requirement's points and outcome, what cost points."""

    number: int
    stress: bool
    points: dict[str, float]
    outcomes: dict[str, str]
    seen: dict[str, str] = field(default_factory=dict)


def flaky(runs: Sequence[GradingRun]) -> list[str]:
    """Return the requirements whose points or outcomes were not the same in all runs."""
    names = list(dict.fromkeys(name for run in runs for name in run.points))
    return [n for n in names if len({(round(r.points.get(n, -1.0), 6), r.outcomes.get(n, "")) for r in runs}) > 1]


def render(runs: Sequence[GradingRun]) -> str:
    """Return a table: for each requirement how often it passed, with and without stress, and all its points."""
    calm, stressed = [r for r in runs if not r.stress], [r for r in runs if r.stress]
    unsteady = set(flaky(runs))
    lines = [f"{'':6}{'calm':>9}{'stress':>9}   points"]
    for name in dict.fromkeys(name for run in runs for name in run.points):
        points = Counter(round(run.points[name], 3) for run in runs if name in run.points)
        shown = ", ".join(f"{value:g}" if len(points) == 1 else f"{value:g} ({n} times)" for value, n in points.items())
        mark = "  FLAKY" if name in unsteady else ""
        lines.append(f"{name:<6}{_passed(calm, name):>9}{_passed(stressed, name):>9}   {shown}{mark}")
        if mark:
            lines += [f"        run {run.number + 1}: {run.seen[name]}" for run in runs if run.seen.get(name)]
    totals = sorted({round(sum(run.points.values()), 3) for run in runs})
    lines.append(f"{'total':<24}   {' to '.join(f'{total:g}' for total in dict.fromkeys((totals[0], totals[-1])))}")
    if unsteady:
        are = "requirement was" if len(unsteady) == 1 else "requirements were"
        lines.append(f"{len(unsteady)} {are} flaky in {len(runs)} runs: {', '.join(sorted(unsteady))}.")
    else:
        lines.append(f"No requirement was flaky in {len(runs)} runs, {len(stressed)} of them under stress.")
    return "\n".join(lines)


def _passed(runs: Sequence[GradingRun], name: str) -> str:
    passed = sum(run.outcomes.get(name) == "passed" for run in runs)
    return f"{passed}/{len(runs)}" if runs else "-"


def grade_repeatedly(
    submission: Path, count: int, *, stress: bool, requirements: Sequence[str] = (), course: Course | None = None
) -> Iterator[GradingRun]:
    """Yield `count` runs.

    Raises:
        GraderError: a grading failed.
    """
    for number in range(count):
        under_stress = stress and number % 2 == 1
        with load_on_every_core() if under_stress else contextlib.nullcontext():
            yield _grade(submission, number, under_stress, requirements, course or find())


@contextlib.contextmanager
def load_on_every_core() -> Iterator[None]:
    """Keep every core busy with two processes each."""
    command = [sys.executable, "-I", "-S", "-c", _BUSY.format(pid=os.getpid())]
    busy = [subprocess.Popen(command) for _ in range(2 * (os.cpu_count() or 1))]
    try:
        yield
    finally:
        for each in busy:
            each.kill()
        for each in busy:
            each.wait()


def _grade(submission: Path, number: int, stress: bool, requirements: Sequence[str], course: Course) -> GradingRun:
    with tempfile.TemporaryDirectory(prefix="flakiness-") as folder:
        command = [sys.executable, "-P", "-m", "grader.selftest.flakiness", str(submission), folder]
        command += [",".join(requirements), str(course.folder)]
        late = {LATE_VARIABLE: str(_LATE_S)} if stress else {}
        ended = subprocess.run(
            command, env={**os.environ, **late}, capture_output=True, text=True, timeout=_GRADING_SECONDS, check=False
        )
        report = Path(folder, "report.json")
        if ended.returncode != 0 or not report.exists():
            raise GraderError(f"Run {number} failed with status {ended.returncode}: {ended.stderr.strip()[-500:]}")
        data = json.loads(report.read_text())
    graded = [each for each in data["requirements"] if each["outcome"] != "not_graded"]
    return GradingRun(
        number,
        stress,
        {r["id"]: r["points"] for r in graded},
        {r["id"]: r["outcome"] for r in graded},
        {r["id"]: r["seen"] for r in graded if r["seen"]},
    )


def add(verbs: Any) -> None:
    """Add the verb to the command line."""
    parser = verbs.add_parser(
        "flakiness",
        help="grade a submission many times and report what is flaky",
        description="Grade a submission N times, each time in a process of its own, and report how often each\n"
        "requirement passed. With --stress, every second run has all cores loaded and discovery delayed.",
        epilog="Example:  grader flakiness team07.zip --runs 30 --stress\n"
        "Exit status: 0 nothing is flaky, 1 something is, 2 wrong usage, 3 an error of the kit or host.",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("submission", type=Path, help="the package's folder, or an archive of it")
    parser.add_argument("--runs", type=int, default=10, help="how often to grade (default 10)")
    parser.add_argument("--stress", action="store_true", help="load every core in every second run")
    parser.add_argument("--course", type=Path, metavar="DIR", help="the folder of the course (default: as for grade)")
    parser.add_argument("--only", nargs="+", default=[], metavar="REQUIREMENT", help="grade only these requirements")
    parser.set_defaults(run=main)


def main(options: argparse.Namespace) -> int:
    """Grade repeatedly, report each run on stderr, and print the table."""
    if options.runs < 1:
        raise UsageError("--runs must be at least 1.")
    course = find(options.course)
    known = [requirement.id for requirement in rubric.load(course.rubric).requirements]
    if unknown := [name for name in options.only if name not in known]:
        raise UsageError(f"there is no requirement {unknown[0]!r}. There are {', '.join(known)}.")
    runs: list[GradingRun] = []
    try:
        for run in grade_repeatedly(
            options.submission, options.runs, stress=options.stress, requirements=options.only, course=course
        ):
            runs.append(run)
            how = "under stress" if run.stress else "calm"
            print(
                f"run {run.number + 1} of {options.runs}, {how}: {sum(run.points.values()):g} points", file=sys.stderr
            )
    finally:  # also if it is interrupted: what is known so far is a table already
        if runs:
            print(render(runs))
    return 1 if flaky(runs) else 0


def _grade_once(submission: Path, out: Path, requirements: str, course: Course) -> None:
    """Grade once, in this process."""
    from grader import building, pipeline, report

    settings = pipeline.Settings(
        rubric=rubric.load(course.rubric),
        course=course,
        cache=building.cache_folder(),
        requirements=tuple(filter(None, requirements.split(","))),
    )
    pipeline.grade(submission, out, settings, write=report.write)


if __name__ == "__main__":
    _grade_once(Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3], load(Path(sys.argv[4])))
