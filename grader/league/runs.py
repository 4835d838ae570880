"""Run handed-in cases on a package of the league."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from grader.course import Course
from grader.league.pool import Package
from grader.sanitize import one_line
from grader.settings import Settings
from grader.trials.case import Case
from grader.trials.observers import Observers
from grader.trials.promises import LIVES, Run, first_broken, hunts, unjudged
from grader.words import say


@dataclass(frozen=True)
class CaseRun:
    """What came of a case on one package: the promise that was `broken` and how, "" if none was, or a `problem`."""

    broken: str = ""
    problem: str = ""


def run_cases(package: Package, cases: Sequence[Case], folder: Path, settings: Settings) -> list[CaseRun]:
    """Return what came of the cases on a package, in order."""
    (folder / "trials").mkdir(parents=True)
    source, built, contract = package.built(folder, settings)
    with Observers(
        settings.course, install=built.install, contract=contract.install, folder=folder / "trials",
        seed=settings.seed, package=source, ros_name=built.facts.package,
    ) as observers:  # fmt: skip
        return [run_case(case, f"case-{number}", observers, settings.course) for number, case in enumerate(cases, 1)]


def run_case(case: Case, name: str, observers: Observers, course: Course) -> CaseRun:
    """Return what came of a case, run as the trial `name`.

    A promise counts as broken if one is when the case is run again, too.
    """
    found = CaseRun()
    for time in range(2):
        trial = observers.run(case.plan(f"{name}-{time}"))
        if trial.script_error or unjudged(trial):
            why = trial.script_error.strip().splitlines()[-1] if trial.script_error else str(trial.ended)
            return CaseRun(problem=say("it cannot be run: {why}", why=one_line(why)))
        try:
            broken = first_broken((*hunts(course).promises, LIVES), Run(case, trial))
        except Exception as error:  # of the course's own code, by what a student has made up
            return CaseRun(problem=say("it cannot be judged: {why}", why=one_line(f"{type(error).__name__}: {error}")))
        if broken is None:
            return CaseRun()
        found = CaseRun(one_line(f"{broken[0].words} {broken[1].seen}", 500))
    return found
