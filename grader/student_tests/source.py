"""The package's own tests as a source of evidence."""

from __future__ import annotations

from grader.processes.jobs import Job, Turn, Where
from grader.source import Asked, Collected, Source, Subject, served
from grader.student_tests.discover import discover_tests, is_run
from grader.student_tests.suite_run import SuiteRun, run_suite
from grader.student_tests.warm_worker import Start
from grader.words import mark, say

OWN_TESTS = mark("the package's own tests")


class StudentTestRuns(Source):
    """Runs the package's own tests."""

    name = "student tests"

    def ask(self, subject: Subject) -> Asked:
        """Return the one job of running them all."""

        def collected(ran: SuiteRun) -> Collected:
            return Collected({"tests": ran.tests}, tuple(ran.flags))

        return Asked([own_tests(subject)], lambda results: collected(results[OWN_TESTS]))


def own_tests(subject: Subject, start: Start | None = None) -> Job[SuiteRun]:
    """Return the job of running the package's own tests, with the tests that reach each line for the mutants.

    `start` starts the workers that run them.
    """
    package, settings = subject.submission.package, subject.settings

    def run() -> SuiteRun:
        modules = discover_tests(package, settings.course.nodes)
        ended: list[str] = []

        def progress(path: str) -> None:
            ended.append(path)
            words = mark("own tests ({n} of {total} files: {path})")
            settings.progress(say(words, n=len(ended), total=sum(map(is_run, modules)), path=path))

        return run_suite(
            package, subject.install, modules, settings.course,
            start=start, progress=progress,
        )  # fmt: skip

    return Job(
        OWN_TESTS, Where.SANDBOX, SuiteRun, run, turn=Turn.CHAIN, lasting=_lasting,
        decided_by=(subject.handed_in, subject.seen_by_nodes),
        serves=served(settings, StudentTestRuns.name),
    )  # fmt: skip


def _lasting(ran: SuiteRun) -> bool:
    """Return whether no module may well end in another way in another run."""
    modules = ran.tests.modules
    return not ran.flags and not any(m.failed or m.errors or m.timed_out or m.unsteady for m in modules)
