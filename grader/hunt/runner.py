"""Run cases on a package: it is built once, and each case is a trial of its nodes in lockstep."""

from __future__ import annotations

import itertools
from collections import deque
from collections.abc import Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from pathlib import Path

from grader import collect, pipeline
from grader.checks import build_log
from grader.errors import SubmissionError
from grader.evidence import Kind, Trial
from grader.host import submission_user, tempdir
from grader.intake.submission import open_submission
from grader.processes import jobs
from grader.settings import Settings
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


@contextmanager
def runner(package: Path, settings: Settings, at_once: int = AT_ONCE) -> Iterator[Runner]:
    """Build a package, or take its build, and yield what runs cases on it, `at_once` of them together.

    Raises:
        SubmissionError: it cannot be read, or does not build.
        GraderError: this host cannot build or run it.
    """
    pipeline.require_host(settings)
    with tempdir.folder("hunt") as folder, submission_user.readable_by_sandboxes(), ExitStack() as closing:
        submission = open_submission(package, folder / "submission", settings.course, package=settings.package_path)
        subject = Subject(submission, settings, folder, closing)
        built, contract = jobs.run(collect.builds(subject), progress=settings.progress).results[collect.BUILD]
        if not built.facts.ok:
            said = build_log.find_error(built.facts.log_tail).said or say("`colcon build` failed")
            raise SubmissionError(
                say("{package} does not build: {error}", package=package.name, error=said),
                say("Build it first; `grader check` shows the whole message."),
            )
        (folder / "trials").mkdir()
        observing = Observers(
            settings.course, install=built.install, contract=contract.install, folder=folder / "trials",
            seed=settings.seed, package=submission.package, ros_name=built.facts.package,
            best_effort=settings.best_effort,
        )  # fmt: skip
        threads = closing.enter_context(ThreadPoolExecutor(at_once))
        closing.callback(threads.shutdown, cancel_futures=True)
        yield Runner(closing.enter_context(observing), threads)
