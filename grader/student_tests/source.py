"""The package's own tests as a source of evidence."""

from __future__ import annotations

from grader.source import Collected, Phase, Subject
from grader.student_tests.discover import discover_tests
from grader.student_tests.suite_run import run_suite


class StudentTestRuns:
    """Runs the package's own tests. Hands over its SuiteRun: mutants are run with the tests that reach them."""

    name = "student tests"
    phase = Phase.RUN
    serves = frozenset({"T1", "T2", "T3"})

    def collect(self, subject: Subject) -> Collected:
        """Return the tests' results and what they cover."""
        package, settings = subject.submission.package, subject.settings
        ran = run_suite(
            package, subject.install, discover_tests(package), seconds=settings.test_seconds, seed=settings.seed,
            progress=lambda path: settings.progress(f"own tests: {path}"),
        )  # fmt: skip
        return Collected({"tests": ran.tests}, tuple(ran.flags), handover=ran)
