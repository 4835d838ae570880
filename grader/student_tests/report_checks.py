"""Check the reports on test modules by runs whose result is known beforehand: sabotaged tests, then probes.

A sabotaged module runs by itself, as it was measured. Probes are shared by all modules, for almost all agree with them;
where one does not, each module is probed by itself.
"""

from __future__ import annotations

import random
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import PurePosixPath

from grader.evidence import TestModule
from grader.student_tests import canary
from grader.student_tests.canary import Probe, Reach
from grader.student_tests.module_request import ModuleRequest
from grader.student_tests.package_modules import PACKAGE
from grader.student_tests.warm_worker import WorkerPool
from grader.student_tests.worker_report import ModuleRun

Sources = Mapping[str, tuple[str, list[str]]]
"""The package's modules: text, and the paths in the sandbox."""


@dataclass(frozen=True)
class Measured:
    """A test module, its text (None if it cannot be read), its runs, the reasons to doubt them, and its dice."""

    module: TestModule
    text: str | None
    runs: list[ModuleRun]
    doubts: list[str]
    rng: random.Random

    @property
    def reach(self) -> Reach:
        """Return which test reached which line in the first run."""
        return self.runs[0].reach

    @property
    def reaching(self) -> set[str]:
        """Return the tests that run code of the package."""
        return {name for lines in self.reach.values() for names in lines.values() for name in names}


def sabotage(workers: WorkerPool, measured: Measured, seconds: float) -> list[str]:
    """Return what is wrong with the reports on tests that were made to fail."""
    tests, module = measured.runs[0].tests, measured.module.path
    if measured.text is None:
        words = "it is in an encoding that the grader does not read, so its reports cannot be checked"
        return [words] if any(test.outcome == "passed" for test in tests) else []
    changed, names = canary.sabotage(measured.text, tests, measured.rng)
    if not names:
        return []
    files = {str(PACKAGE / module): changed}
    request = ModuleRequest(module, files=files, select=names, limit=seconds, total=seconds)
    again = workers.run(request)
    if canary.is_silent(again, names):
        again = workers.run(request)  # once may be an accident
    problem = canary.judge_sabotage(again, names)
    return [problem] if problem else []


def probe(
    workers: WorkerPool, measured: Sequence[Measured], sources: Sources, rng: random.Random, seconds: float
) -> tuple[dict[str, list[str]], set[str]]:
    """Return for each module which probes contradict the reports on it, and the modules whose tests cannot fail."""
    contradicted: dict[str, list[str]] = {tested.module.path: [] for tested in measured}
    probed = [
        (tested, tests) for tested in measured if (tests := canary.probed_tests(tested.runs[0].tests, tested.rng))
    ]
    probed = [(tested, tests) for tested, tests in probed if tested.text is not None]
    together = _fit_together(probed, sources)
    shared = _probe_together(workers, together, sources, rng, seconds) if len(together) > 1 else []
    alone = [pair for pair in probed if not shared or pair not in together]
    runs = {tested.module.path: shared for tested, _ in probed}
    for (tested, _), own in zip(
        alone, workers.map(lambda pair: _probe_alone(workers, *pair, sources, seconds), alone), strict=True
    ):
        contradicted[tested.module.path] += [
            problem for probe, ran in own if (problem := canary.judge_probe(ran, probe))
        ]
        runs[tested.module.path] = own
    return contradicted, {
        tested.module.path
        for tested, tests in probed
        if canary.is_idle(runs[tested.module.path], [name for name in tests if name in tested.reaching])
    }


def _fit_together(probed: Sequence[tuple[Measured, list[str]]], sources: Sources) -> list[tuple[Measured, list[str]]]:
    """Return the modules that can share probes.

    Not those whose tests call a function that another module calls on import, for that makes it another probe's; and
    not those with a name that another one has, for pytest may take one for the other.
    """
    texts = _texts(sources)
    called = [canary.functions_reached(texts, tested.reach) for tested, _ in probed]
    on_import = {place for _, importing in called for place in importing}
    names = Counter(_name(tested) for tested, _ in probed)
    return [
        (tested, tests)
        for (tested, tests), (in_tests, _) in zip(probed, called, strict=True)
        if not in_tests & on_import and names[_name(tested)] == 1
    ]


def _probe_together(
    workers: WorkerPool,
    probed: Sequence[tuple[Measured, list[str]]],
    sources: Sources,
    rng: random.Random,
    seconds: float,
) -> list[tuple[Probe, ModuleRun]]:
    """Return how all modules ran at once on the probes; [] if they do not agree, so that each is probed alone."""
    reach: dict[str, dict[int, frozenset[str]]] = {}
    for tested, _ in probed:
        for path, lines in tested.reach.items():
            known = reach.setdefault(path, {})
            for line, tests in lines.items():
                known[line] = known.get(line, frozenset()) | tests
    first, *others = (tested.module.path for tested, _ in probed)
    names = [name for _, tests in probed for name in tests]
    limits = {name: limit for tested, _ in probed for name, limit in _limits(tested).items()}

    def agrees(probe: Probe, ran: ModuleRun) -> bool:
        # An import that raises keeps all tests from running; else every test must have run.
        complete = bool(ran.collection_error) or {test.id for test in ran.tests} >= set(names)
        return ran.finished and not ran.timed_out and complete and not canary.judge_probe(ran, probe)

    made = canary.probes(_texts(sources), reach, rng)
    requests = [_request(first, probe, sources, names, limits, seconds, beside=others) for probe in made]
    runs = list(zip(made, workers.map(workers.run, requests), strict=True))
    return runs if all(agrees(probe, ran) for probe, ran in runs) else []


def _probe_alone(
    workers: WorkerPool, measured: Measured, tests: list[str], sources: Sources, seconds: float
) -> list[tuple[Probe, ModuleRun]]:
    """Return how a module ran on each probe."""
    made = canary.probes(_texts(sources), measured.reach, measured.rng)
    requests = (_request(measured.module.path, probe, sources, tests, _limits(measured), seconds) for probe in made)
    return [(probe, workers.run(request)) for probe, request in zip(made, requests, strict=True)]


def _request(
    module: str, probe: Probe, sources: Sources, tests: Sequence[str], limits: Mapping[str, float], seconds: float,
    beside: Sequence[str] = (),
) -> ModuleRequest:  # fmt: skip
    files = {inside: text for path, text in probe.texts.items() for inside in sources[path][1]}
    return ModuleRequest(
        module, files=files, beside=beside, select=tests, coverage=True, limits=limits, limit=20.0, total=seconds
    )


def _limits(measured: Measured) -> dict[str, float]:
    """Return the time for each test. Broken functions may leave one waiting forever; three times its time is enough."""
    return {test.id: 2.0 + 3 * test.seconds for test in measured.runs[0].tests}


def _texts(sources: Sources) -> dict[str, str]:
    return {path: text for path, (text, _) in sources.items()}


def _name(measured: Measured) -> str:
    return PurePosixPath(measured.module.path).name
