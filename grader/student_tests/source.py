"""The package's own tests as a source of evidence."""

from __future__ import annotations

from grader.evidence import StudentTests, TestModule
from grader.source import Collected, Source, Subject, served
from grader.student_tests.discover import discover_tests
from grader.student_tests.suite_run import run_suite
from grader.words import say


class StudentTestRuns(Source):
    """Runs the package's own tests. Hands over its SuiteRun: mutants are run with the tests that reach them."""

    name = "student tests"

    def collect(self, subject: Subject) -> Collected:
        """Return the tests' results and what they cover."""
        package, settings = subject.submission.package, subject.settings
        decided_by = ("tests", subject.text, subject.program, str(settings.test_seconds))
        # Mutants need more of a run than is kept.
        if (not served(settings, "mutation") & settings.checked or subject.kept.holds(*mutants_key(subject))) and (
            kept := subject.kept.find(StudentTests, *decided_by)
        ):
            return Collected({"tests": kept[0]}, kept={"the package's own tests": kept[1]})
        ran = run_suite(
            package, subject.install, discover_tests(package, settings.course.nodes), settings.course,
            seconds=settings.test_seconds, progress=lambda path: settings.progress(say("own tests: {path}", path=path)),
        )  # fmt: skip
        if not (ran.flags or any(_in_doubt(module) for module in ran.tests.modules)):
            subject.kept.keep(ran.tests, *decided_by)
        return Collected({"tests": ran.tests}, tuple(ran.flags), handover=ran)


def _in_doubt(module: TestModule) -> bool:
    """Return whether another run of a test module may well end in another way."""
    return bool(module.failed or module.errors or module.timed_out or module.unsteady)


def mutants_key(subject: Subject) -> tuple[str, ...]:
    """Return what decides which mutants are noticed."""
    return "mutants", subject.text, subject.program, str(subject.settings.mutation_budget_s)
