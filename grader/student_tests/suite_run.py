"""Run a package's own tests in a sandbox, each module in a process of its own, and measure what they cover.

What the tests' process reports is data. It is believed where runs of known result come out as they must (`canary`).
"""

from __future__ import annotations

import contextlib
import random
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from grader.course import Course
from grader.evidence import Flag, StudentTests, TestModule
from grader.host import turns
from grader.sandbox import untrusted
from grader.settings import MODULE_TIMEOUT_S
from grader.student_tests import canary, package_modules, report_checks
from grader.student_tests.coverage import combine
from grader.student_tests.discover import is_run
from grader.student_tests.kept_runs import KeptRuns
from grader.student_tests.module_request import ModuleRequest
from grader.student_tests.module_results import ModuleReach, failures, flags, module_reach, with_results
from grader.student_tests.package_modules import PACKAGE
from grader.student_tests.padding import code_of, padding, padding_flags
from grader.student_tests.report_checks import Measured
from grader.student_tests.warm_worker import WorkerPool, start_workers
from grader.student_tests.worker_report import ModuleRun, TestResult

WORKERS = 2
_MODULES_AT_MOST = 100
_EXCLUDED_AT_MOST = 5  # tests that hang or crash, each of which takes another run of its module


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
    seed: int = 0,
    kept_runs: KeptRuns | None = None,
    progress: Callable[[str], None] = lambda _name: None,
) -> SuiteRun:
    """Return the modules with their results, and what they cover of the package.

    Args:
        package: the package's source folder; a copy of it is the tests' working folder.
        install: the package's install tree.
        modules: what `discover_tests` found; stubs are not run.
        course: the assignment; its nodes and functions decide what the tests can reach.
        seconds: wall time for each module.
        seed: decides the canaries.
        kept_runs: runs that need not be done again.
        progress: called with the path of each module that has ended.
    """
    wanted = [m for m in modules if is_run(m)][:_MODULES_AT_MOST]
    if not wanted:
        contract = code_of(package, install, course).of_contract
        return SuiteRun(StudentTests(modules=list(modules), of_contract=contract))
    sources = package_modules.replaceable(package, install)
    code = code_of(package, install, course)
    with contextlib.ExitStack() as stack:
        # Each module may be run again without the tests that hang, and three times more to check the reports.
        life = 60.0 + (_EXCLUDED_AT_MOST + 7) * seconds * len(wanted)
        count = min(WORKERS, len(wanted))
        stack.enter_context(turns.reserve(count))
        workers = stack.enter_context(start_workers(package, install, count, seconds=life, kept_runs=kept_runs))

        def measure(module: TestModule) -> Measured:
            # One for each module, so that what is drawn does not depend on which module comes first.
            rng = random.Random(f"canaries {seed} {module.path}")
            measured = _measure_steadily(workers, module, untrusted.read_python(package / module.path), rng, seconds)
            measured.doubts.extend(report_checks.sabotage(workers, measured, seconds))
            progress(module.path)
            return measured

        # The longest first, or the other workers wait for it at the end.
        longest_first = sorted(wanted, key=lambda module: -module.tests)
        by_path = {made.module.path: made for made in workers.map(measure, longest_first)}
        measured = [by_path[module.path] for module in wanted]
        runs = {made.module.path: made.runs for made in measured}
        every = [run for both in runs.values() for run in both]
        padded = padding(code, [run.reach for run in every])
        contradicted, idle = report_checks.probe(workers, measured, sources, random.Random(f"probes {seed}"), seconds)
        covered, unexplained = combine(
            package, install, workers.folder, every, {path: text for path, (text, _) in sources.items()}, code.unreached
        )
    doubts = [f"{made.module.path}: {doubt}" for made in measured for doubt in made.doubts]
    doubts += unexplained
    doubts += [f"{module}: {doubt}" for module, doubted in contradicted.items() for doubt in doubted]
    tests = StudentTests(
        modules=[with_results(m, code, runs[m.path], m.path in idle) if m.path in runs else m for m in modules],
        coverage=covered,
        doubts=doubts,
        of_contract=code.of_contract,
        nodes=sorted(set[str]().union(*code.homes.values())),
    )
    firsts = {path: both[0] for path, both in runs.items()}
    flagged = [*flags(doubts, firsts, code), *padding_flags(padded, [run.reach for run in every])]
    return SuiteRun(tests, [module_reach(m, *runs[m.path]) for m in wanted], flagged)


def _measure_steadily(
    workers: WorkerPool, module: TestModule, text: str | None, rng: random.Random, seconds: float
) -> Measured:
    """Return two runs of the module, which show what is steady, and the reasons to doubt them."""
    first, doubts = _measure(workers, module, rng, seconds)
    runs = [first]
    if failures(first) and not first.timed_out:
        # Nodes that do not discover each other in time are not the test author's mistake: both runs count in T2.
        second, more = _measure(workers, module, rng, seconds)
        runs.append(second)
        doubts += more
    elif not first.timed_out:
        runs.append(workers.run(ModuleRequest(module.path, limit=seconds, total=seconds)))
    return Measured(module, text, runs, doubts, rng)


def _measure(
    workers: WorkerPool, module: TestModule, rng: random.Random, seconds: float
) -> tuple[ModuleRun, list[str]]:
    """Return how a module ran under coverage, beside a canary, and why its reports are in doubt.

    A test that hangs or ends the process takes along what was measured of the others, so these run again without it.
    """
    beside = canary.make_canary(module.path, rng)
    request = ModuleRequest(
        module.path, files={str(PACKAGE / beside.path): beside.text}, beside=[beside.path], coverage=True,
        limit=seconds, total=seconds,
    )  # fmt: skip
    ran = workers.run(request)
    doubts = [canary.judge_canary(ran, beside)]
    collected, late = ran.collected, ran.timed_out
    excluded: list[TestResult] = []
    while ran.culprit in ran.collected and (left := _without_culprit(ran, beside, len(excluded))):
        words = "ran out of time" if ran.timed_out else f"ended the process that ran it, with status {ran.status}"
        excluded.append(TestResult(ran.culprit, "error", words, ran.seconds))
        ran = workers.run(replace(request, select=left))
        doubts.append(canary.judge_canary(ran, beside))
        late = late or ran.timed_out
    known = {test.id for test in (*ran.tests, *excluded)}
    words = "did not run, because too many tests before it hung or ended the process"
    untried = [TestResult(name, "error", words) for name in collected if excluded and name not in known]
    own = [test for test in (*ran.tests, *excluded, *untried) if not test.id.startswith(beside.path)]
    return replace(
        ran, tests=tuple(own), collected=tuple(name for name in collected if not name.startswith(beside.path)),
        timed_out=late,
    ), [doubt for doubt in doubts if doubt]  # fmt: skip


def _without_culprit(ran: ModuleRun, beside: canary.Canary, excluded: int) -> list[str]:
    """Return what to run again without the test that hung or crashed; after some of those, what is known to end."""
    if excluded > _EXCLUDED_AT_MOST:
        return []
    left = [name for name in ran.collected if name != ran.culprit]
    if excluded == _EXCLUDED_AT_MOST:
        ended = {test.id for test in ran.tests}
        left = [name for name in left if name in ended or name.startswith(beside.path)]
    return left if any(not name.startswith(beside.path) for name in left) else []
