"""The package's own tests as a source of evidence, run in a sandbox, each module in a process of its own.

What the tests' process reports is data. A last run, on functions that do nothing but raise, shows which tests can fail.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, field, replace
from pathlib import Path

from grader.course import Course
from grader.evidence import Flag, StudentTests, TestModule
from grader.processes.jobs import Job, Where
from grader.settings import MODULE_TIMEOUT_S
from grader.source import Asked, Collected, Source, Subject, served
from grader.student_tests import package_modules
from grader.student_tests.coverage import combine
from grader.student_tests.discover import copy_flags, discover_tests, is_run
from grader.student_tests.module_results import ModuleReach, ModuleRuns, failures, flags
from grader.student_tests.package_modules import function_lines, raising
from grader.student_tests.warm_worker import ModuleRequest, WorkerPool, start_workers
from grader.student_tests.worker_report import ModuleRun, TestResult
from grader.words import mark, say

OWN_TESTS = mark("the package's own tests")
_MODULES_AT_MOST = 100
_EXCLUDED_AT_MOST = 5  # tests that hang or crash, each of which takes another run of its module


class StudentTestRuns(Source):
    """Runs the package's own tests."""

    name = "student tests"

    def ask(self, subject: Subject) -> Asked:
        """Return the one job of running them all."""

        def collected(results: Mapping[str, SuiteRun]) -> Collected:
            return Collected({"tests": results[OWN_TESTS].tests}, tuple(results[OWN_TESTS].flags))

        return Asked([own_tests(subject)], collected)


def own_tests(subject: Subject, workers: WorkerPool | None = None) -> Job[SuiteRun]:
    """Return the job of running the package's own tests, with the tests that reach each line for the mutants.

    `workers` run them, by default workers of their own.
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
            workers=workers, progress=progress,
        )  # fmt: skip

    return Job(
        OWN_TESTS, Where.SANDBOX, SuiteRun, run, lasting=_lasting,
        decided_by=(subject.handed_in, subject.seen_by_nodes),
        serves=served(settings, StudentTestRuns.name),
    )  # fmt: skip


def _lasting(ran: SuiteRun) -> bool:
    """Return whether no module may well end in another way in another run."""
    modules = ran.tests.modules
    return not ran.flags and not any(m.failed or m.errors or m.timed_out or m.unsteady for m in modules)


@dataclass(frozen=True)
class SuiteRun:
    """The tests as evidence, what they reach (for `mutation`), and what an instructor should look at."""

    tests: StudentTests
    reach: list[ModuleReach] = field(default_factory=list)
    flags: list[Flag] = field(default_factory=list)


def run_suite(
    package: Path,
    install: Path,
    modules: Sequence[TestModule],
    course: Course,
    *,
    seconds: float = MODULE_TIMEOUT_S,
    workers: WorkerPool | None = None,
    progress: Callable[[str], None] = lambda _name: None,
) -> SuiteRun:
    """Return the modules with their results, and what they cover of the package.

    Args:
        package: the package's source folder; a copy of it is the tests' working folder.
        install: the package's install tree.
        modules: what `discover_tests` found; stubs are not run.
        course: the assignment, whose nodes the tests may start.
        seconds: wall time for each module.
        workers: what runs them, by default workers of their own.
        progress: called with the path of each module that has ended.
    """
    wanted = [m for m in modules if is_run(m)][:_MODULES_AT_MOST]
    if not wanted:
        return SuiteRun(StudentTests(modules=list(modules)))
    texts = package_modules.texts(package, install)
    functions = {path: function_lines(text) for path, text in texts.items() if text is not None}
    probe = {inside: raising(text) for inside, text in package_modules.copies(package, install, texts).items()}
    with nullcontext(workers) if workers else start_workers(package, install) as pool:

        def measure(module: TestModule) -> ModuleRuns:
            found = ModuleRuns(module, _run_steadily(pool, module, seconds), functions=functions)
            if passed := found.passed_first:
                # Functions that raise may leave a test waiting forever; three times its time is enough. A test that
                # passes only while it is measured shows in the probe what it does then.
                request = ModuleRequest(
                    module.path, files=probe, select=[test.id for test in passed], total=seconds,
                    limits={test.id: 2.0 + 3 * test.seconds for test in passed}, limit=20.0,
                    coverage=bool(found.unsteady),
                )  # fmt: skip
                found = replace(found, probe=_run_to_the_end(pool, request))
            progress(module.path)
            return found

        # The longest first, or the other workers wait for it at the end.
        longest_first = sorted(wanted, key=lambda module: -module.tests)
        by_path = {made.module.path: made for made in pool.map(measure, longest_first)}
        measured = [by_path[module.path] for module in wanted]
        covered = combine(package, install, pool.folder, [run for made in measured for run in made.runs], texts)
    found = [*flags(measured), *copy_flags(package, texts)]
    places = package_modules.handed_in(package, texts)
    results = [by_path[m.path].results(course.nodes, places) if m.path in by_path else m for m in modules]
    covered = [replace(file, path=places.get(file.path, file.path)) for file in covered]
    return SuiteRun(StudentTests(results, covered), [made.reach() for made in measured], found)


def _run_steadily(workers: WorkerPool, module: TestModule, seconds: float) -> list[ModuleRun]:
    """Return two runs of the module, which show what is steady; one if it hangs. After failures both are measured."""
    request = ModuleRequest(module.path, coverage=True, limit=seconds, total=seconds)
    first = _run_to_the_end(workers, request)
    if first.timed_out:
        return [first]
    # Nodes that do not discover each other in time are not the test author's mistake: then both runs count in T2.
    return [first, _run_to_the_end(workers, replace(request, coverage=bool(failures(first))))]


def _run_to_the_end(workers: WorkerPool, request: ModuleRequest) -> ModuleRun:
    """Return how a module ran.

    A test that hangs or ends the process takes along what was measured of the others, so these run again without it.
    """
    ran = workers.run(request)
    collected, late = ran.collected, ran.timed_out
    excluded: list[TestResult] = []
    while ran.culprit in ran.collected and (left := _without_culprit(ran, len(excluded))):
        words = "ran out of time" if ran.timed_out else f"ended the process that ran it, with status {ran.status}"
        excluded.append(TestResult(ran.culprit, "error", words, ran.seconds))
        ran = workers.run(replace(request, select=left))
        late = late or ran.timed_out
    known = {test.id for test in (*ran.tests, *excluded)}
    words = "did not run, because too many tests before it hung or ended the process"
    untried = [TestResult(name, "error", words) for name in collected if excluded and name not in known]
    return replace(ran, tests=(*ran.tests, *excluded, *untried), collected=collected, timed_out=late)


def _without_culprit(ran: ModuleRun, excluded: int) -> list[str]:
    """Return what to run again without the test that hung or crashed; after some of those, only what has ended."""
    if excluded > _EXCLUDED_AT_MOST:
        return []
    known = {test.id for test in ran.tests} if excluded == _EXCLUDED_AT_MOST else set(ran.collected)
    return [name for name in ran.collected if name != ran.culprit and name in known]
