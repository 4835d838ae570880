"""Hunt: run made-up cases in order until one breaks a promise, then let Hypothesis shrink it.

Hypothesis asks for one case after another, and a case takes a second. So it is asked again and again with the same
seed: first it only lists its cases, which are then run several at a time; then it gets what came of them, finds the
first that failed as if it had run them itself, and says which smaller ones to try, of which two are run at a time.
"""

from __future__ import annotations

import itertools
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, replace

import hypothesis
from hypothesis import HealthCheck, Phase

from grader.errors import SubmissionError
from grader.evidence import Kind, Trial
from grader.source import Subject
from grader.trials.case import Case
from grader.trials.observers import Observers
from grader.trials.promises import Broken, Making, Promise, Run, first_broken, unjudged
from grader.words import say

SHRINKS = 60
"""How many further cases may be run to make a found one smaller."""
AGAIN = 5
"""How often a found case has to fail, to be shown."""
AT_ONCE = 2
"""How many cases are run at once."""


class Runner:
    """Runs cases of one package, and remembers what came of each: `run` runs no case twice.

    It has threads of its own for all cases, because an observer ends with the thread that has started it.
    """

    def __init__(self, observing: Observers, threads: ThreadPoolExecutor) -> None:
        self._observers, self._threads = observing, threads
        self._numbers = itertools.count(1)
        self.known: dict[Case, Trial] = {}

    def run(self, cases: Iterable[Case]) -> Iterator[tuple[Case, Trial]]:
        """Yield cases with their trials, in order; several are run at once, a few ahead of what has been yielded."""
        waiting: deque[tuple[Case, Future[Trial] | None]] = deque()
        for case in cases:
            waiting.append((case, None if case in self.known else self._threads.submit(self._observe, case)))
            if len(waiting) > 2 * AT_ONCE:
                yield self._next(waiting)
        while waiting:
            yield self._next(waiting)

    def again(self, case: Case, times: int) -> list[Trial]:
        """Return new trials of a case, whatever is known of it."""
        return list(self._threads.map(self._observe, [case] * times))

    def _next(self, waiting: deque[tuple[Case, Future[Trial] | None]]) -> tuple[Case, Trial]:
        case, future = waiting.popleft()
        if future:
            self.known[case] = future.result()
        return case, self.known[case]

    def _observe(self, case: Case) -> Trial:
        trial = self._observers.run(case.plan(f"case-{next(self._numbers)}"))
        if trial.ended is not None and trial.ended.kind is Kind.WAITED:
            raise SubmissionError(say("The hunt has ended: {why}.", why=trial.ended), trial.ended.cure)
        return trial


def of_build(subject: Subject) -> Runner:
    """Return what runs cases on a subject's build, some of them together, until the subject is closed."""
    assert subject.contract is not None
    settings, folder = subject.settings, subject.folder / "cases"
    folder.mkdir()
    observing = Observers(
        settings.course, install=subject.install, contract=subject.contract.install, folder=folder,
        seed=0, package=subject.submission.package, ros_name=subject.ros_name, best_effort=settings.best_effort,
    )  # fmt: skip
    threads = subject.closing.enter_context(ThreadPoolExecutor(AT_ONCE))
    subject.closing.callback(threads.shutdown, cancel_futures=True)
    return Runner(subject.closing.enter_context(observing), threads)


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
    number, smallest, made = 0, None, listed(making, cases, seed)
    for number, (case, trial) in enumerate(runner.run(itertools.takewhile(lambda _: goes_on(), made)), 1):
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
        known = dict.fromkeys(made[: number - 1]) | {case: finding}
        smallest = _shrunk(runner, making, known, cases, seed, shrinks, found)
        break
    return Hunted(number, seed, smallest, tuple(unsteady), tuple(left_out))


def listed(making: Making, cases: int, seed: int) -> list[Case]:
    """Return the cases that Hypothesis makes up with a seed."""
    made: list[Case] = []
    _drive(making, cases, seed, made.append, (Phase.generate,))
    return made


def _shrunk(
    runner: Runner,
    making: Making,
    known: dict[Case, Finding | None],
    cases: int,
    seed: int,
    shrinks: int,
    found: Callable[[Finding], object],
) -> Finding:
    """Return the smallest case that breaks the same promise, of those that Hypothesis tries and `shrinks` allow.

    `known` says what the cases up to the first finding break. An unsteady one counts as one that breaks nothing.
    """
    smaller, before = [*filter(None, known.values())], len(known)
    while True:
        wanted, broken = _asked(making, known, cases, seed, min(AT_ONCE, before + shrinks - len(known)))
        if broken is not smaller[-1]:
            smaller.append(broken)
            found(broken)
        if not wanted:
            break
        for case, trial in runner.run(wanted):
            known[case] = _finding(case, trial, [broken.promise], broken.after)
    while len(smaller) > 1 and not _holds(runner, smaller[-1]):
        smaller.pop()
    return replace(smaller[-1], shrunk_in=len(known) - before)


def _asked(
    making: Making, known: dict[Case, Finding | None], cases: int, seed: int, count: int
) -> tuple[list[Case], Finding]:
    """Return the next `count` cases that Hypothesis asks for, and the smallest that it has found by then.

    Hypothesis waits for what came of a case before it names the next. So it is asked anew, from the start, each time,
    and told of those without a result that they break nothing, as most do not.
    """
    wanted: dict[Case, None] = {}
    broken: list[Finding] = []

    def judge(case: Case) -> None:
        if len(wanted) >= count > 0:
            raise _EnoughError
        if finding := known.get(case):
            broken.append(finding)
            raise _FoundError
        if case not in known and count:
            wanted[case] = None

    with suppress(_FoundError, _EnoughError):
        _drive(making, cases, seed, judge, (Phase.generate, Phase.shrink))
    return [*wanted], broken[-1]


class _EnoughError(BaseException):
    """There are as many cases as were wanted. No `Exception`, which Hypothesis would take for a broken promise."""


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
