"""Run cases on a package that is built: each case is a trial of its nodes in lockstep."""

from __future__ import annotations

import itertools
from collections import deque
from collections.abc import Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor

from grader.errors import SubmissionError
from grader.evidence import Kind, Trial
from grader.source import Subject
from grader.trials.case import Case
from grader.trials.observers import Observers
from grader.words import say

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


def of_build(subject: Subject, at_once: int = AT_ONCE) -> Runner:
    """Return what runs cases on a subject's build, `at_once` of them together, until the subject is closed."""
    assert subject.contract is not None
    settings, folder = subject.settings, subject.folder / "cases"
    folder.mkdir()
    observing = Observers(
        settings.course, install=subject.install, contract=subject.contract.install, folder=folder,
        seed=0, package=subject.submission.package, ros_name=subject.ros_name, best_effort=settings.best_effort,
    )  # fmt: skip
    threads = subject.closing.enter_context(ThreadPoolExecutor(at_once))
    subject.closing.callback(threads.shutdown, cancel_futures=True)
    return Runner(subject.closing.enter_context(observing), threads)
