"""The handed-in cases as a source of evidence: each is run on every package of the league, and none of the student."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from grader.course import Course
from grader.evidence import League, LeagueCase
from grader.league import handed_in, pool
from grader.league.handed_in import HandedIn
from grader.league.pool import Package
from grader.processes.jobs import Job, Turn, Where
from grader.sanitize import one_line
from grader.settings import Settings
from grader.source import Asked, Collected, Phase, Source, Subject
from grader.trials.case import Case
from grader.trials.observers import Observers
from grader.trials.promises import LIVES, OURS, Run, first_broken, hunts
from grader.words import say


@dataclass(frozen=True)
class CaseRun:
    """What came of a case on one package: the promise that was `broken` and how, "" if none was, or a `problem`."""

    broken: str = ""
    problem: str = ""


class LeagueCases(Source):
    """Runs what is in a submission's folder `cases` on the solution, its variants and the broken packages."""

    name = "league"
    phase = Phase.DATA

    def ask(self, subject: Subject) -> Asked:
        """Return a job for each package. On a machine without them, as a student's, there is nothing to collect."""
        settings = subject.settings
        packages = pool.read(settings.course)
        if not any(package.broken for package in packages):
            return Asked([], lambda _results: Collected())
        files = handed_in.read(subject.submission.package, settings.course)
        cases = [each.case for each in files if each.case]
        names = [f"{self.name} {number} of {len(packages)}" for number, _ in enumerate(packages, 1)]
        jobs = [
            Job(
                name, Where.NETWORK, list[CaseRun],
                partial(_runs, package, cases, subject.folder / name.replace(" ", "-"), settings),
                decided_by=(package.content, *(case.text() for case in cases)),
                lasting=lambda runs: not any(run.problem for run in runs),
                turn=Turn.PLACE, serves=self.serves(settings),
                says=say("the handed-in cases on package {name}", name=name.removeprefix(self.name).strip()),
            )
            for name, package in zip(names, packages, strict=True) if cases
        ]  # fmt: skip

        def collected(results: Mapping[str, Any]) -> Collected:
            runs = {name: iter(results[name]) for name in names if cases}
            found = []
            for each in files:
                ran = [(package, next(runs[name])) for package, name in zip(packages, names, strict=True) if each.case]
                found.append(_found(each, ran))
            return Collected({self.name: League(found, sum(package.broken for package in packages))})

        return Asked(jobs, collected)


def _found(each: HandedIn, ran: Sequence[tuple[Package, CaseRun]]) -> LeagueCase:
    """Return what a file has come to by its runs on all packages."""
    right = [run for package, run in ran if not package.broken]
    return LeagueCase(
        each.path,
        problem=each.problem or next((run.problem for run in right if run.problem), ""),
        unfair=next((run.broken for run in right if run.broken), ""),
        caught=[package.name for package, run in ran if package.broken and run.broken],
    )


def _runs(package: Package, cases: Sequence[Case], folder: Path, settings: Settings) -> list[CaseRun]:
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
        if trial.script_error or (trial.ended is not None and trial.ended.kind in OURS):
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
