"""Hunts as a source of evidence: one for each requirement at which the rubric has `hunt`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

from grader.errors import SubmissionError
from grader.evidence import BrokenPromise, Hunt, Kind, Reason, Trial
from grader.processes.jobs import Job, Turn, Where
from grader.scoring.rubric import Requirement
from grader.settings import Settings
from grader.source import Asked, Collected, Source, Subject
from grader.trials.request import ALL_BEHIND_S, not_started
from grader.trials.source import integrity_flags, started_by
from grader.words import mark, say

if TYPE_CHECKING:
    from grader.hunt.search import Runner

_SAYS = mark("hunting for {requirement}: {cases} made-up cases")
Result = tuple[Hunt, list[Trial]]
"""What a hunt has come to, and the trial that shows it if there is one."""


class Hunts(Source):
    """Hunts in as many cases as the rubric says, never for a time, so that any machine comes to the same."""

    name = "hunt"

    def ask(self, subject: Subject) -> Asked:
        """Return a job for each hunt. They follow each other, because a later one takes the trials of the same cases.

        The grading's seed decides which cases are made up; students have another one.
        """
        # With Hypothesis, whose import takes a second, and numpy, which starts threads (check_process has to have one).
        from grader.hunt import search

        settings, running = subject.settings, search.of_build(subject)
        hunted = [requirement for requirement in settings.wanted if requirement.hunt]
        found: list[Job[Any]] = []
        for requirement in hunted:
            found.append(Job(
                f"hunt {requirement.id}", Where.NETWORK, tuple[Hunt, list[Trial]],
                partial(_hunt, running, requirement, settings),
                decided_by=(*started_by(subject), str(requirement.hunt)),
                lasting=lambda result: result[0].broken is not None or not result[1],
                after=found[-1].name if found else "",
                turn=Turn.CORE, serves=frozenset({requirement.id}),
                says=say(_SAYS, requirement=requirement.id, cases=requirement.hunt),
            ))  # fmt: skip
        return Asked(found, lambda results: _collected({r.id: results[f"hunt {r.id}"] for r in hunted}))


def _hunt(running: Runner, requirement: Requirement, settings: Settings, _before: object = None) -> Result:
    from grader.hunt import search
    from grader.trials.case import Case
    from grader.trials.promises import hunts

    of_requirement, name = hunts(settings.course).of([requirement.id]), f"hunt_{requirement.id}"
    try:
        hunted = search.hunt(running, *of_requirement, cases=requirement.hunt, seed=settings.seed)
    except SubmissionError:  # what its callbacks have waited in all cases is more than a grading waits
        ended = Reason(Kind.WAITED, seconds=ALL_BEHIND_S)
        return Hunt(0, trial=name), [not_started(Case("", ()).plan(name), 0, ended=ended)]
    facts = Hunt(hunted.cases, len(hunted.unsteady))
    if (found := hunted.finding) is not None:
        case = f"breaks: {found.promise.name}\n{found.case.text}"
        broken = BrokenPromise(found.promise.name, found.promise.sentence, found.broken.seen, case)
        return replace(facts, broken=broken, trial=name), [replace(found.trial, name=name)]
    if hunted.unjudged:  # else a node that brings observers down keeps every promise
        return replace(facts, trial=name), [replace(hunted.unjudged[0], name=name)]
    return facts, []


def _collected(results: Mapping[str, Result]) -> Collected:
    trials = {trial.name: trial for _, shown in results.values() for trial in shown}
    hunted = {name: hunt for name, (hunt, _) in results.items()}
    return Collected({"hunts": hunted, "trials": trials}, tuple(integrity_flags(trials)))
