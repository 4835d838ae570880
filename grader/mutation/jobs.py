"""Run the package's own tests on changed sources, as many at a time as there are workers."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from grader.mutation.selection import Selection
from grader.mutation.source_text import Change, SourceText
from grader.student_tests.module_results import ModuleReach
from grader.student_tests.warm_worker import ModuleRequest, WorkerPool
from grader.student_tests.worker_report import ModuleRun

_LONGEST = 60.0  # seconds for the tests of one module on one mutant


@dataclass(frozen=True)
class TestedPackage:
    """What is known before the first mutant: sources, their paths in the sandbox, and what each test module reaches."""

    __test__ = False

    sources: Mapping[str, SourceText]
    paths: Mapping[str, list[str]]
    reach: Mapping[str, ModuleReach]

    def files(self, change: Change | None) -> dict[str, str]:
        """Return the files that differ from the original, by their paths in the sandbox."""
        return dict.fromkeys(self.paths[change.path], self.sources[change.path].apply(change)) if change else {}


@dataclass(frozen=True)
class Job:
    """A change (None: the original) and the tests to run on it.

    `examines` is set for equivalent mutants: the mutant that was noticed by the test under examination. `patience`
    multiplies the time limits.
    """

    change: Change | None
    selections: tuple[Selection, ...]
    examines: Change | None = None
    patience: float = 1.0

    @property
    def changed(self) -> Change:
        """Return the change of a job that has one."""
        assert self.change is not None
        return self.change

    @property
    def tests(self) -> list[str]:
        """Return the names of all tests to run."""
        return [name for selection in self.selections for name in selection.tests]


@dataclass(frozen=True)
class JobResult:
    """The first failure, if any: the test and its module. `ran` counts the tests that ran; `seconds` are wall time."""

    job: Job
    noticed_by: str = ""
    module: str = ""
    timed_out: bool = False
    ran: int = 0
    seconds: float = 0.0
    failed: tuple[str, ...] = ()
    tried: bool = True


class JobRunner:
    """Runs jobs by a pool of workers until a point in time (of time.monotonic); later jobs are not tried."""

    def __init__(self, workers: WorkerPool, package: TestedPackage, until: float) -> None:
        self._workers, self._package, self._until = workers, package, until
        self.size = workers.size
        self.seconds_spent = 0.0
        """The sum over all jobs, as on a quiet machine."""

    def run(self, jobs: Sequence[Job]) -> list[JobResult]:
        """Return the jobs' results, in the jobs' order."""

        def run_one(job: Job) -> JobResult:
            in_time = time.monotonic() <= self._until
            return run_job(self._workers, self._package, job) if in_time else JobResult(job, tried=False)

        results = self._workers.map(run_one, jobs)
        self.seconds_spent += sum(result.seconds for result in results)
        return results


def run_job(workers: WorkerPool, package: TestedPackage, job: Job) -> JobResult:
    """Run a job's tests, module by module, until one fails."""
    files = package.files(job.change)
    seconds, count = 0.0, 0
    for selection in job.selections:
        known = package.reach[selection.module].seconds
        limits = {name: job.patience * min(2.0 + 8 * known.get(name, 0.0), _LONGEST) for name in selection.tests}
        ran = workers.run(
            ModuleRequest(
                selection.module, files=files, select=selection.tests, first_failure=True, limits=limits,
                limit=10.0 * job.patience, total=job.patience * min(20.0 + 8 * sum(known.values()), _LONGEST),
            )
        )  # fmt: skip
        if ran.worker_lost:
            break  # a test that ends the process which runs it has reported nothing
        seconds += ran.quiet_seconds
        count += len(ran.tests)
        if by := _noticed_by(ran, selection):
            failed = tuple(test.id for test in ran.tests if test.outcome in ("failed", "error")) or (by,)
            return JobResult(job, by, selection.module, bool(ran.timed_out), count, seconds, failed)
    return JobResult(job, ran=count, seconds=seconds)


def _noticed_by(ran: ModuleRun, selection: Selection) -> str:
    """Return the test that failed, or the whole module if it could not be collected or ended too soon; "" for none."""
    failure = ran.failure
    return f"{selection.module} ({failure})" if failure and failure not in selection.tests else failure
