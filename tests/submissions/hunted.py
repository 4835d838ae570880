"""Hunt in the reference, its variants and the known-bad submissions, and print what is found and how soon.

    PYTHONPATH=.:tests python -m submissions.hunted [--cases N] [--again N] [NAME ...]

Without names all are hunted in: for every requirement of a hunt in the reference and its variants, where nothing may be
found, and in each known-bad submission for the requirements that it costs, where something should be. The exit status
is 1 if something is found that should not, or if a found case is not found each time that it is run `--again`, half of
these times while all cores are busy.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from variants import VARIANTS, make

from grader import building, pipeline
from grader.course import kits_own
from grader.errors import SubmissionError
from grader.hunt import search
from grader.hunt.search import Runner
from grader.hunting import runner
from grader.scoring import rubric
from grader.trials.promises import Run, hunts, judged
from submissions.edits import EDITS, apply

REFERENCE = "reference"
GROUPS = (("F8", "F9", "F10"), ("F1", "F2", "F3", "F5", "F11"), ("F4",), ("F6",), ("F7",), ("F12", "F13"), ("I8",))
"""Requirements that are hunted for together in a package in which nothing may be found."""


def behavioural() -> list[str]:
    """Return the known-bad submissions that cost a requirement of a hunt, and few others."""
    known = set(hunts(kits_own()).requirements)
    return [name for name, edit in EDITS.items() if edit.costs & known and len(edit.costs) <= 4]


def _groups(name: str) -> Sequence[tuple[str, ...]]:
    """Return what to hunt for in a package; in an edit what it costs, the group first in which it costs most."""
    if name not in EDITS:
        return GROUPS
    costs = [tuple(r for r in group if r in EDITS[name].costs) for group in GROUPS]
    return sorted(filter(None, costs), key=len, reverse=True)


@contextmanager
def package(name: str) -> Iterator[Path]:
    """Yield a package by its name."""
    with tempfile.TemporaryDirectory() as folder:
        if name in EDITS or name == REFERENCE:
            yield apply(EDITS.get(name), Path(folder))
        else:
            yield make(VARIANTS[name], Path(folder))


def main(arguments: list[str]) -> int:
    """Hunt, print a line for each hunt, and return 1 if something is not as it should be."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*")
    parser.add_argument("--cases", type=int, default=500)
    parser.add_argument("--again", type=int, default=0, metavar="N", help="run what is found N times more")
    options = parser.parse_args(arguments)
    wrong = 0
    for name in options.names or [REFERENCE, *VARIANTS, *behavioural()]:
        for group in _groups(name):
            found, is_wrong = _hunt(name, group, options)
            wrong += is_wrong
            if found and name in EDITS:
                break
    return int(bool(wrong))


def _hunt(name: str, group: tuple[str, ...], options: argparse.Namespace) -> tuple[bool, bool]:
    """Hunt in a package, and return whether something was found, and whether something is not as it should be."""
    course = kits_own()
    making, promises = hunts(course).of(group)
    settings = pipeline.Settings(
        rubric=rubric.load(course.rubric), cache=building.cache_folder(), requirements=making.serves
    )
    began, found_at = time.monotonic(), 0.0

    def note(_finding: search.Finding) -> None:
        nonlocal found_at
        found_at = found_at or time.monotonic()

    with package(name) as folder:
        try:
            with runner(folder, settings) as running:
                began = time.monotonic()
                found = search.hunt(running, making, promises, cases=options.cases, found=note)
                shrunk_at = time.monotonic()
                again = _again(running, found.finding, options.again) if found.finding else 0
        except SubmissionError as error:
            print(f"{name:36} {' '.join(group):18} {error}", flush=True)
            return False, False
    seconds = shrunk_at - began
    unsteady = f"; {len(found.unsteady)} unsteady" if found.unsteady else ""
    if found.finding is None:
        print(f"{name:36} {' '.join(group):18} {found.cases:4} cases, {seconds:5.0f} s, nothing{unsteady}", flush=True)
        return False, False
    finding, shrinking = found.finding, shrunk_at - found_at
    size = f"{len(finding.case.steps):2} steps, {finding.shrunk_in} cases, {shrinking:4.0f} s smaller"
    steady = f"; again {again} of {options.again} times" if options.again else ""
    seen = f"{finding.promise.name}: {finding.broken.seen}{unsteady}{steady}"
    print(
        f"{name:36} {' '.join(group):18} case {finding.after:3}, {seconds - shrinking:5.0f} s; {size}; {seen}",
        flush=True,
    )
    return True, name not in EDITS or again < options.again


def _again(running: Runner, finding: search.Finding, times: int) -> int:
    """Run a found case `times` more, half of them beside a busy loop for each core; return how often it is found."""
    trials = running.again(finding.case, times - times // 2)
    busy = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(os.cpu_count() or 1)]
    try:
        trials += running.again(finding.case, times // 2)
    finally:
        for each in busy:
            each.kill()
            each.wait()
    return sum(judged(finding.promise, Run(finding.case, trial)) is not None for trial in trials)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
