"""Hunt: run made-up cases in order until one breaks a promise, then let Hypothesis shrink it.

Hypothesis asks for one case after another, and a case takes a second. So it is asked twice with the same seed: first it
only lists its cases, which are then run several at a time; then it asks again, gets what came of them, finds the
first that failed as if it had run them itself, and shrinks that.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Collection, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import hypothesis
from hypothesis import HealthCheck, Phase

from grader.evidence import Trial
from grader.hunt.runner import Runner
from grader.trials.case import Case
from grader.trials.promises import Broken, Making, Promise, Run, first_broken, unjudged

SHRINKS = 60
"""How many further cases may be run to make a found one smaller."""
AGAIN = 5
"""How often a found case has to fail, to be shown."""


@dataclass(frozen=True)
class Finding:
    """A case in which a promise is broken, the trial that shows it, and after how many cases it was found."""

    case: Case
    trial: Trial
    promise: Promise
    broken: Broken
    after: int
    shrunk_in: int = 0


@dataclass(frozen=True)
class Hunted:
    """What a hunt has come to: how many cases were tried, and the finding if there is one.

    `unsteady` are cases that failed once and not when they were run again: they are not a finding. `unjudged` are
    trials that cannot be judged: their case cannot be run, or they ended early in a way that breaks no promise.
    """

    cases: int
    seed: int
    finding: Finding | None = None
    unsteady: tuple[Finding, ...] = ()
    unjudged: tuple[Trial, ...] = ()


def hunt(
    runner: Runner,
    making: Making,
    promises: Sequence[Promise],
    *,
    cases: int,
    seed: int = 0,
    shrinks: int = SHRINKS,
    goes_on: Callable[[], bool] = lambda: True,
    found: Callable[[Finding], object] = lambda _finding: None,
    tried: Callable[[int], object] = lambda _number: None,
) -> Hunted:
    """Try up to `cases` made-up cases, while `goes_on`, and return what was found.

    `found` is called with each finding as soon as it is there, and each smaller one, `tried` with how many cases were
    run by now.
    The same seed tries the same cases in the same order, however many are run at once.
    """
    unsteady: list[Finding] = []
    left_out: list[Trial] = []
    number = 0
    for number, (case, trial) in enumerate(
        runner.run(itertools.takewhile(lambda _: goes_on(), listed(making, cases, seed))), 1
    ):
        tried(number)
        finding = _finding(case, trial, promises, number)
        if finding is None:
            left_out += [trial] if trial.script_error or unjudged(trial) else []
            continue
        if not _holds(runner, finding):
            unsteady.append(finding)
            continue
        found(finding)
        if number == 1 and not trial.ready:  # it never comes up, each time after a wait
            shrinks = 0
        spoilt = {each.case for each in unsteady}
        smallest = _shrunk(runner, making, finding, spoilt, cases, seed, shrinks, found)
        return Hunted(number, seed, smallest, tuple(unsteady), tuple(left_out))
    return Hunted(number, seed, None, tuple(unsteady), tuple(left_out))


def listed(making: Making, cases: int, seed: int) -> list[Case]:
    """Return the cases that Hypothesis makes up with a seed."""
    made: list[Case] = []
    _drive(making, cases, seed, made.append, (Phase.generate,))
    return made


def _shrunk(
    runner: Runner,
    making: Making,
    first: Finding,
    unsteady: Collection[Case],
    cases: int,
    seed: int,
    shrinks: int,
    found: Callable[[Finding], object],
) -> Finding:
    """Return the smallest case that breaks the same promise, of those that Hypothesis tries and `shrinks` allow.

    An unsteady case counts as one that breaks nothing: Hypothesis meets those before the first finding again.
    """
    smaller, tries = [first], 0

    def judge(case: Case) -> None:
        nonlocal tries
        if case in unsteady:
            return
        if case not in runner.known:
            if tries >= shrinks:
                return
            tries += 1
            for _ in runner.run([case]):
                pass
        finding = _finding(case, runner.known[case], [first.promise], first.after)
        if finding is None:
            return
        if case not in [each.case for each in smaller] and _size(case) <= _size(smaller[-1].case):
            smaller.append(finding)
            found(finding)
        raise _FoundError

    with suppress(_FoundError):
        _drive(making, cases, seed, judge, (Phase.generate, Phase.shrink))
    while len(smaller) > 1 and not _holds(runner, smaller[-1]):
        smaller.pop()
    return replace(smaller[-1], shrunk_in=tries)


class _FoundError(Exception):
    """A promise was broken."""


def _drive(making: Making, cases: int, seed: int, judge: Callable[[Case], object], phases: tuple[Phase, ...]) -> None:
    @hypothesis.seed(seed)
    @hypothesis.settings(
        max_examples=cases, phases=phases, database=None, deadline=None, derandomize=False,
        suppress_health_check=list(HealthCheck), report_multiple_bugs=False, verbosity=hypothesis.Verbosity.quiet,
    )  # fmt: skip
    @hypothesis.given(making.cases)
    def each(case: Case) -> None:
        judge(case)

    each()


def _finding(case: Case, trial: Trial, promises: Sequence[Promise], number: int) -> Finding | None:
    broken = first_broken(promises, Run(case, trial))
    return Finding(case, trial, *broken, number) if broken else None


def _holds(runner: Runner, finding: Finding) -> bool:
    """Return whether a case breaks the promise each time that it is run again."""
    again = runner.again(finding.case, AGAIN)
    return all(first_broken([finding.promise], Run(finding.case, trial)) for trial in again)


def _size(case: Case) -> tuple[int, int]:
    return len(case.steps), len(case.text)
