"""Run a package's own tests in a sandbox, each module in a process of its own, and measure what they cover.

What the tests' process reports is data. It is believed where runs of known result come out as they must (`canary`).
"""

from __future__ import annotations

import random
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from pathlib import Path

from grader.evidence import Flag, StudentTests, TestModule
from grader.sandbox import untrusted
from grader.settings import MODULE_TIMEOUT_S
from grader.student_tests import canary, package_modules
from grader.student_tests.coverage import combine
from grader.student_tests.module_results import ModuleReach, failures, flags, module_reach, with_results
from grader.student_tests.package_modules import PACKAGE
from grader.student_tests.warm_worker import ModuleRequest, WarmWorker, start_workers
from grader.student_tests.worker_report import ModuleRun, TestResult

_MODULES_AT_MOST = 100


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
    *,
    seconds: float = MODULE_TIMEOUT_S,
    seed: int = 0,
    progress: Callable[[str], None] = lambda _name: None,
) -> SuiteRun:
    """Return the modules with their results, and what they cover of the package.

    Args:
        package: the package's source folder; a copy of it is the tests' working folder.
        install: the package's install tree.
        modules: what `discover_tests` found; stubs are not run.
        seconds: wall time for each module.
        seed: decides the canaries.
        progress: called with the path of each module that has ended.
    """
    wanted = [m for m in modules if m.tests and not m.stub][:_MODULES_AT_MOST]
    if not wanted:
        return SuiteRun(StudentTests(modules=list(modules)))
    doubts: list[str] = []
    runs: dict[str, list[ModuleRun]] = {}
    sources = package_modules.replaceable(package, install)
    # While one worker measures a module, the other checks whether the reports on the one before can be believed.
    with (
        start_workers(package, install, 2, seconds=60.0 + 3 * seconds * len(wanted)) as (worker, other),
        ThreadPoolExecutor(1) as beside,
    ):
        checks = []
        for module in wanted:
            # One for each module, so that what is drawn does not depend on which module comes first.
            rng = random.Random(f"canaries {seed} {module.path}")
            runs[module.path], doubted = _measure_steadily(worker, module, rng, seconds)
            doubts += [f"{module.path}: {doubt}" for doubt in doubted]
            first = runs[module.path][0]
            checks.append(beside.submit(_check_reports, other, package, module, first, sources, rng, seconds))
            progress(module.path)
        covered, unexplained = combine(
            package, install, worker.out.parent, [run for both in runs.values() for run in both],
            {path: text for path, (text, _) in sources.items()},
        )  # fmt: skip
        doubts += unexplained
        for module, check in zip(wanted, checks, strict=True):
            doubts += [f"{module.path}: {doubt}" for doubt in check.result()]
    tests = StudentTests(
        modules=[with_results(m, package, *runs[m.path]) if m.path in runs else m for m in modules],
        coverage=covered,
        doubts=doubts,
    )
    firsts = {path: both[0] for path, both in runs.items()}
    return SuiteRun(tests, [module_reach(m, firsts[m.path]) for m in wanted], flags(doubts, firsts))


def _measure_steadily(
    worker: WarmWorker, module: TestModule, rng: random.Random, seconds: float
) -> tuple[list[ModuleRun], list[str]]:
    """Return the module's run, a second one if tests failed in the first, and the reasons to doubt them."""
    first, doubt = _measure(worker, module, rng, seconds)
    runs, doubts = [first], [doubt]
    if failures(first) and not first.timed_out:
        # Nodes that do not discover each other in time are not the test author's mistake.
        second, doubt = _measure(worker, module, rng, seconds)
        runs.append(second)
        doubts.append(doubt)
    return runs, [doubt for doubt in doubts if doubt]


def _measure(worker: WarmWorker, module: TestModule, rng: random.Random, seconds: float) -> tuple[ModuleRun, str]:
    """Return how a module ran under coverage, beside a canary, and why its reports are in doubt ("" if not)."""
    beside = canary.make_canary(module.path, rng)
    request = ModuleRequest(
        module.path, files={str(PACKAGE / beside.path): beside.text}, beside=[beside.path], coverage=True,
        limit=seconds, total=seconds,
    )  # fmt: skip
    ran = worker.run(request)
    doubt = canary.judge_canary(ran, beside)
    others = [name for name in ran.collected if name != ran.timed_out]
    if ran.timed_out in ran.collected and others:
        # A test that hangs takes along what was measured of the others: run them again without it.
        again = worker.run(replace(request, select=others))
        late = TestResult(ran.timed_out, "error", "ran out of time", ran.seconds)
        ran = replace(
            again, tests=(*again.tests, late), collected=(*again.collected, ran.timed_out), timed_out=ran.timed_out
        )
    return replace(
        ran,
        tests=tuple(test for test in ran.tests if not test.id.startswith(beside.path)),
        collected=tuple(name for name in ran.collected if not name.startswith(beside.path)),
    ), doubt  # fmt: skip


def _check_reports(
    worker: WarmWorker, package: Path, module: TestModule, ran: ModuleRun,
    sources: Mapping[str, tuple[str, list[str]]], rng: random.Random, seconds: float,
) -> list[str]:  # fmt: skip
    """Return what came out wrong in runs whose result is known beforehand: sabotaged tests, then probes."""
    text = untrusted.read_python(package / module.path)
    if text is None:
        words = "it is in an encoding that the grader does not read, so its reports cannot be checked"
        return [words] if any(test.outcome == "passed" for test in ran.tests) else []
    found = []
    changed, names = canary.sabotage(text, ran.tests, rng)
    if names:
        files = {str(PACKAGE / module.path): changed}
        again = worker.run(ModuleRequest(module.path, files=files, select=names, limit=seconds, total=seconds))
        found.append(canary.judge_sabotage(again, names))
    tests = canary.probed_tests(ran.tests, rng)
    # Broken functions may leave a test waiting forever; three times what it took is enough.
    limits = {test.id: 2.0 + 3 * test.seconds for test in ran.tests}
    texts = {path: text for path, (text, _) in sources.items()}
    for probe in canary.probes(texts, ran.reach, rng) if tests else []:
        files = {inside: text for path, text in probe.texts.items() for inside in sources[path][1]}
        again = worker.run(
            ModuleRequest(
                module.path, files=files, select=tests, coverage=True, limits=limits, limit=20.0, total=seconds
            )
        )
        found.append(canary.judge_probe(again, probe))
    return [problem for problem in found if problem]
