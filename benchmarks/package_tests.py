"""Measure what it costs to run a package's own tests: results and coverage (T1, T2), and the mutants (T3).

    python -m benchmarks.package_tests [--rounds N] [--package FOLDER] [--quick]

CPU seconds of this process and of all that it starts, without the build and without judging: the runs alone. `--quick`
takes the two shortest test modules and the mutants that they reach, in some seconds.
"""

from __future__ import annotations

import argparse
import ctypes
import os
import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from benchmarks.sandbox_cost import REFERENCE, cpu_seconds
from grader import building, sandbox
from grader.course import kits_own
from grader.evidence import Mutation
from grader.mutation.source import mutate
from grader.student_tests.discover import discover_tests
from grader.student_tests.source import SuiteRun, run_suite
from grader.student_tests.warm_worker import ModuleRequest, WarmWorker
from grader.student_tests.worker_report import ModuleRun

_SUBREAPER = 36  # prctl: orphans of our children become our children, and their CPU time ours
_QUICK_MODULES = 2


@dataclass(frozen=True)
class Cost:
    """What one part of the work took: CPU and wall time, and how many runs of pytest."""

    cpu_s: float
    wall_s: float
    runs: int


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__.splitlines()[0], epilog="example: python -m benchmarks.package_tests --rounds 3"
    )
    parser.add_argument("--rounds", type=int, default=3, help="how often to measure (default %(default)s)")
    parser.add_argument("--package", type=Path, default=REFERENCE, help="a package (default: the reference)")
    parser.add_argument("--quick", action="store_true", help="once, a small part of it")
    options = parser.parse_args()
    sandbox.require()  # starts what all sandboxes share
    ctypes.CDLL(None).prctl(_SUBREAPER, 1, 0, 0, 0)
    package = options.package.resolve()
    built = building.build([package], building.cache_folder(), kits_own(), main=package.name)
    if not built.facts.ok:
        parser.error(f"{package} does not build; `grader check` says why")
    load = os.getloadavg()[0]
    rounds = [measure(package, built.install, options.quick) for _ in range(1 if options.quick else options.rounds)]
    print(f"{package.name}, median of {len(rounds)}, load at the start {load:.1f}\n")
    print("| what | CPU s | wall s | runs of pytest |")
    print("|---|--:|--:|--:|")
    for number, name in enumerate(("results and coverage (T1, T2)", "mutants (T3)")):
        costs = [costs[number] for costs, _, _ in rounds]
        cpu, wall = (statistics.median(values) for values in ([c.cpu_s for c in costs], [c.wall_s for c in costs]))
        print(f"| {name} | {cpu:.1f} | {wall:.1f} | {costs[0].runs} |")
    _, suite, mutation = rounds[-1]
    passed = sum(module.passed for module in suite.tests.modules)
    outcomes = [mutant.outcome for mutant in mutation.mutants]
    print(
        f"\n{passed} tests passed; {len(outcomes) - outcomes.count('not tried')} of {len(outcomes)} mutants were tried,"
    )
    print(
        f"{outcomes.count('noticed')} of them noticed; {len(mutation.equivalent_mutants)} equivalent mutants besides."
    )


def measure(package: Path, install: Path, quick: bool) -> tuple[tuple[Cost, Cost], SuiteRun, Mutation]:
    """Run the package's tests, then its mutants; return what each took and what was found."""
    modules = discover_tests(package, kits_own().nodes)
    if quick:
        modules = sorted(modules, key=lambda module: (package / module.path).stat().st_size)[:_QUICK_MODULES]
    suites: list[SuiteRun] = []
    first = cost(lambda: suites.append(run_suite(package, install, modules, kits_own())))
    mutations: list[Mutation] = []
    second = cost(lambda: mutations.append(mutate(package, install, suites[0].reach, kits_own())))
    return (first, second), suites[0], mutations[0]


def cost(work: Callable[[], None]) -> Cost:
    """Return what `work` takes."""
    runs = [0]
    in_sandboxes: dict[sandbox.Process, float] = {}  # killed in the end, and so in no parent's books
    plain = WarmWorker.run

    def counted(self: WarmWorker, request: ModuleRequest) -> ModuleRun:
        runs[0] += 1
        ran = plain(self, request)
        in_sandboxes[self.process] = self.process.cpu_seconds()
        return ran

    WarmWorker.run = counted  # type: ignore[method-assign]
    began = time.monotonic()
    try:
        cpu_s = cpu_seconds(work)
    finally:
        WarmWorker.run = plain  # type: ignore[method-assign]
    return Cost(cpu_s + sum(in_sandboxes.values()), time.monotonic() - began, runs[0])


if __name__ == "__main__":
    main()
