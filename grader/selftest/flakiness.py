"""Grade a submission many times and say for each requirement how often it passed: `grader certify`.

A requirement that passes sometimes is a fault of ours, whatever the submission is like. Each grading is a process of
its own; with stress every second one runs with every core loaded and its observers finding the nodes late.
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
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from grader.errors import GraderError
from grader.trials.request import LATE_VARIABLE

_LATE_S = 1.5
_GRADING_SECONDS = 3600.0


@dataclass(frozen=True)
class Run:
    """One grading: its number, whether it was under stress, and each requirement's points, their sum, its outcome."""

    number: int
    stress: bool
    points: dict[str, float]
    outcomes: dict[str, str]
    sha256: str = ""


def flickering(runs: Sequence[Run]) -> list[str]:
    """Return the requirements that did not come out alike in all runs: by points or by outcome."""
    names = list(dict.fromkeys(name for run in runs for name in run.points))
    return [n for n in names if len({(round(r.points.get(n, -1.0), 6), r.outcomes.get(n, "")) for r in runs}) > 1]


def render(runs: Sequence[Run]) -> str:
    """Return a table: requirement, how often it passed, with and without stress, and what else it came out as."""
    calm, stressed = [r for r in runs if not r.stress], [r for r in runs if r.stress]
    unsteady = set(flickering(runs))
    lines = [f"{'':6}{'calm':>9}{'stress':>9}   points"]
    for name in dict.fromkeys(name for run in runs for name in run.points):
        points = Counter(round(run.points[name], 3) for run in runs if name in run.points)
        shown = ", ".join(f"{value:g}" if len(points) == 1 else f"{value:g} ({n} times)" for value, n in points.items())
        mark = "  FLICKERS" if name in unsteady else ""
        lines.append(f"{name:<6}{_passed(calm, name):>9}{_passed(stressed, name):>9}   {shown}{mark}")
    if unsteady:
        lines.append(f"{len(unsteady)} requirements flickered in {len(runs)} runs: {', '.join(sorted(unsteady))}.")
    else:
        lines.append(f"No requirement flickered in {len(runs)} runs, {len(stressed)} of them under stress.")
    return "\n".join(lines)


def run(
    submission: Path,
    log: Path,
    count: int,
    *,
    stress: bool,
    requirements: Sequence[str] = (),
    arguments: Sequence[str] = (),
) -> Iterator[Run]:
    """Yield the runs, those that `log` holds already first; a new one is written to it as soon as it has ended.

    Raises:
        GraderError: a grading failed, or the log is of something else; what was done so far stays in `log`.
    """
    done = load(log)
    yield from done[:count]
    for number in range(len(done), count):
        under_stress = stress and number % 2 == 1
        with load_on_every_core() if under_stress else contextlib.nullcontext():
            found = _grade(submission, number, under_stress, requirements, arguments)
        if done and (found.sha256, set(found.points)) != (done[0].sha256, set(done[0].points)):
            raise GraderError(
                f"{log} holds runs of another submission or requirements. Name another --log, or remove it."
            )
        log.parent.mkdir(parents=True, exist_ok=True)
        with log.open("a") as stream:
            stream.write(json.dumps(found.__dict__) + "\n")
        yield found


def load(log: Path) -> list[Run]:
    """Return the runs that a log holds. A line that was cut off when somebody killed us is done again."""
    found: list[Run] = []
    for line in log.read_text().splitlines() if log.exists() else []:
        try:
            found.append(Run(**json.loads(line)))
        except (ValueError, TypeError):
            break
    if log.exists():
        log.write_text("".join(json.dumps(each.__dict__) + "\n" for each in found))
    return found


@contextlib.contextmanager
def load_on_every_core() -> Iterator[None]:
    """Keep every core busy with two processes each."""
    busy = [
        subprocess.Popen([sys.executable, "-I", "-S", "-c", _BUSY.format(pid=os.getpid())])
        for _ in range(2 * (os.cpu_count() or 1))
    ]
    try:
        yield
    finally:
        for each in busy:
            each.kill()
        for each in busy:
            each.wait()


# Ends by itself when we have been killed.
_BUSY = "import os\nwhile os.getppid() == {pid}:\n    sum(range(100000))"


def _grade(submission: Path, number: int, stress: bool, requirements: Sequence[str], arguments: Sequence[str]) -> Run:
    with tempfile.TemporaryDirectory(prefix="certify-") as folder:
        command = [
            sys.executable,
            "-m",
            "grader.selftest.flakiness",
            str(submission),
            folder,
            ",".join(requirements),
            *arguments,
        ]
        late = {LATE_VARIABLE: str(_LATE_S)} if stress else {}
        ended = subprocess.run(
            command, env={**os.environ, **late}, capture_output=True, text=True, timeout=_GRADING_SECONDS, check=False
        )
        report = Path(folder, "report.json")
        if ended.returncode != 0 or not report.exists():
            raise GraderError(f"Run {number} failed with status {ended.returncode}: {ended.stderr.strip()[-500:]}")
        data = json.loads(report.read_text())
    graded = [each for each in data["requirements"] if each["outcome"] != "not_graded"]
    return Run(
        number, stress, {r["id"]: r["points"] for r in graded}, {r["id"]: r["outcome"] for r in graded}, data["sha256"]
    )


def _passed(runs: Sequence[Run], name: str) -> str:
    passed = sum(run.outcomes.get(name) == "passed" for run in runs)
    return f"{passed}/{len(runs)}" if runs else "-"


def add(verbs: Any) -> None:
    """Add the verb to the command line."""
    parser = verbs.add_parser(
        "certify",
        help="grade a submission many times and say what flickers",
        description="Grade a submission N times, each time in a process of its own, and say for each requirement how\n"
        "often it passed. With --stress every second run has all cores loaded and discovery delayed.",
        epilog="Example:  grader certify solution_pkg/ros2_robot_controller --runs 30 --stress\n"
        "Exit status: 0 nothing flickers, 1 something does, 2 wrong usage, 3 a fault of ours.",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("submission", type=Path, help="the package's folder, or an archive of it")
    parser.add_argument("--runs", type=int, default=10, help="how often (default 10)")
    parser.add_argument("--stress", action="store_true", help="load every core in every second run")
    parser.add_argument("--only", nargs="+", default=[], metavar="REQUIREMENT", help="these requirements only")
    parser.add_argument("--log", type=Path, help="goes on with the runs in this file (default: out/certify/NAME.jsonl)")
    parser.set_defaults(run=main)


def main(options: argparse.Namespace) -> int:
    """Grade again and again; print the table after each run's line."""
    if options.runs < 1:
        print("grader: --runs must be at least 1.", file=sys.stderr)
        return 2
    log = options.log or Path("out", "certify", f"{options.submission.resolve().name}.jsonl")
    runs = []
    for each in run(options.submission, log, options.runs, stress=options.stress, requirements=options.only):
        runs.append(each)
        how = "under stress" if each.stress else "calm"
        print(f"run {each.number + 1} of {options.runs}, {how}: {sum(each.points.values()):g} points", file=sys.stderr)
    print(render(runs))
    print(f"Runs: {log}")
    return 1 if flickering(runs) else 0


def _one() -> int:
    """Grade once, in this process, into a folder."""
    from grader import build, pipeline, report
    from grader.scoring import rubric

    submission, out, requirements = sys.argv[1:4]
    settings = pipeline.Settings(
        rubric=rubric.load(rubric.RUBRIC),
        cache=build.cache_folder(),
        requirements=tuple(filter(None, requirements.split(","))),
    )
    pipeline.grade(Path(submission), Path(out), settings, write=report.write)
    return 0


if __name__ == "__main__":
    sys.exit(_one())
