"""The handed-in cases as a source of evidence: each is run on every package of the league, and none of the student."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

from grader.evidence import League, LeagueCase
from grader.league import pool
from grader.league.pool import Package
from grader.processes.jobs import Job, Turn, Where
from grader.source import Asked, Collected, Phase, Source, Subject
from grader.words import say

if TYPE_CHECKING:
    from grader.league.cases import CaseRun


class LeagueCases(Source):
    """Runs what is in a submission's folder `cases` on the solution, its variants and the broken packages."""

    name = "league"
    phase = Phase.DATA

    def ask(self, subject: Subject) -> Asked:
        """Return a job for each package. On a machine without them, as a student's, there is nothing to collect."""
        from grader.league.cases import CaseRun, read, run_cases  # with Hypothesis, whose import takes a second

        settings = subject.settings
        packages = pool.read(settings.course)
        if not any(package.broken for package in packages):
            return Asked([], lambda _results: Collected())
        files = read(subject.submission.package, settings.course)
        cases = [case for _, case in files if case]
        names = [f"{self.name} {number} of {len(packages)}" for number, _ in enumerate(packages, 1)]
        jobs = [
            Job(
                name, Where.NETWORK, list[CaseRun],
                partial(run_cases, package, cases, subject.folder / name.replace(" ", "-"), settings),
                decided_by=(package.content, *(case.text for case in cases)),
                lasting=lambda runs: not any(run.problem for run in runs),
                turn=Turn.CORE, serves=self.serves(settings),
                says=say("the handed-in cases on package {name}", name=name.removeprefix(self.name).strip()),
            )
            for name, package in zip(names, packages, strict=True) if cases
        ]  # fmt: skip

        def collected(results: Mapping[str, Any]) -> Collected:
            runs = {name: iter(results[name]) for name in names if cases}
            found = []
            for each, case in files:
                ran = [(package, next(runs[name])) for package, name in zip(packages, names, strict=True) if case]
                found.append(_found(each, ran))
            return Collected({self.name: League(found, sum(package.broken for package in packages))})

        return Asked(jobs, collected)


def _found(each: LeagueCase, ran: Sequence[tuple[Package, CaseRun]]) -> LeagueCase:
    """Return what a file has come to by its runs on all packages."""
    right = [run for package, run in ran if not package.broken]
    return replace(
        each,
        problem=each.problem or next((run.problem for run in right if run.problem), ""),
        unfair=next((run.broken for run in right if run.broken), ""),
        caught=[package.name for package, run in ran if package.broken and run.broken],
    )
