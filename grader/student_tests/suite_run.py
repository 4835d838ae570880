"""Run a package's own tests behind a wall, each module in a process of its own, and measure what they cover.

What the tests' process reports is data. It is believed where runs of known result come out as they must (`canary`).
"""

from __future__ import annotations

import random
import re
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from pathlib import Path

from grader.evidence import Flag, StudentTests, TestModule
from grader.host import ros_env
from grader.sandbox import untrusted
from grader.settings import MODULE_TIMEOUT_S
from grader.student_tests import canary
from grader.student_tests.coverage import combine
from grader.student_tests.mentions import mentions
from grader.student_tests.warm_worker import PACKAGE, Bench, Ran, Request, Test, benches, places, sources

_MODULES_AT_MOST = 100


@dataclass(frozen=True)
class Reach:
    """What one module's tests reach: for each test that passed its seconds, and for each line the tests.

    The test "" stands for importing, and for fixtures that several tests share. Where there are such fixtures the
    tests depend on each other (`whole`), and only all of them together say something.
    """

    module: str
    seconds: Mapping[str, float]
    lines: Mapping[str, Mapping[int, frozenset[str]]]
    whole: bool = False
    readers: frozenset[str] = frozenset()
    """Tests that read the package's source: what they notice of faults says nothing of what the package does."""


@dataclass(frozen=True)
class SuiteRun:
    """The tests as evidence, what they reach (for `mutation`), and what an instructor should look at."""

    tests: StudentTests
    reach: list[Reach] = field(default_factory=list)
    flags: list[Flag] = field(default_factory=list)


def run_modules(
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
        modules: what `read_modules` found; stubs are not run.
        seconds: wall time for each module.
        seed: decides the canaries.
        progress: told the path of each module that has ended.
    """
    wanted = [m for m in modules if m.tests and not m.stub][:_MODULES_AT_MOST]
    if not wanted:
        return SuiteRun(StudentTests(modules=list(modules)))
    doubts: list[str] = []
    runs: dict[str, Ran] = {}
    measured: list[Ran] = []
    passed_then: dict[str, set[str]] = {}
    texts = _probeable(package, install)
    # While one bench measures a module, the other looks whether what was measured of those before can be believed.
    with (
        benches(package, install, 2, seconds=60.0 + 3 * seconds * len(wanted)) as (bench, other),
        ThreadPoolExecutor(1) as beside,
    ):
        looks = []
        for module in wanted:
            # For each module its own, so that what is drawn does not depend on who is first.
            chance = random.Random(f"canaries {seed} {module.path}")
            runs[module.path], doubt = _measure(bench, module, chance, seconds)
            doubts += [f"{module.path}: {doubt}"] if doubt else []
            measured.append(runs[module.path])
            if _failures(runs[module.path]) and not runs[module.path].late:
                # Nodes that do not find each other in time are not the fault of who wrote the test.
                second, doubt = _measure(bench, module, chance, seconds)
                doubts += [f"{module.path}: {doubt}"] if doubt else []
                measured.append(second)
                passed_then[module.path] = {test.id for test in second.tests if test.outcome == "passed"}
            looks.append(beside.submit(_doubts, other, package, module, runs[module.path], texts, chance, seconds))
            progress(module.path)
        believable = {path: text for path, (text, _) in texts.items()}
        covered, unexplained = combine(package, install, bench.out.parent, measured, believable)
        doubts += unexplained
        for module, look in zip(wanted, looks, strict=True):
            doubts += [f"{module.path}: {doubt}" for doubt in look.result()]
    tests = StudentTests(
        modules=[
            _of_what_it_tests(_results(m, runs[m.path], passed_then.get(m.path, set())), package, runs[m.path])
            if m.path in runs
            else m
            for m in modules
        ],
        coverage=covered,
        doubts=doubts,
    )
    refused = {hook for ran in runs.values() for hook in ran.refused}
    flags = [*_flags(doubts, refused), *_readers(runs), *mentions(package)]
    return SuiteRun(tests, [_reach(m, runs[m.path]) for m in wanted], flags)


def _measure(bench: Bench, module: TestModule, chance: random.Random, seconds: float) -> tuple[Ran, str]:
    """Return how a module ran under coverage, beside a canary, and what its reports make doubtful."""
    bird = canary.canary(module.path, chance)
    request = Request(
        module.path, files={str(PACKAGE / bird.path): bird.text}, beside=[bird.path], coverage=True, limit=seconds,
        total=seconds,
    )  # fmt: skip
    ran = bench.run(request)
    doubt = canary.judge_canary(ran, bird)
    others = [name for name in ran.collected if name != ran.late]
    if ran.late in ran.collected and others:
        # A test that hangs takes along what was measured of the others: once more, without it.
        again = bench.run(replace(request, select=others))
        late = Test(ran.late, "error", "ran out of time", ran.seconds)
        ran = replace(again, tests=(*again.tests, late), collected=(*again.collected, ran.late), late=ran.late)
    return replace(
        ran,
        tests=tuple(test for test in ran.tests if not test.id.startswith(bird.path)),
        collected=tuple(name for name in ran.collected if not name.startswith(bird.path)),
    ), doubt  # fmt: skip


def _doubts(
    bench: Bench, package: Path, module: TestModule, ran: Ran, sources: Mapping[str, tuple[str, list[str]]],
    chance: random.Random, seconds: float,
) -> list[str]:  # fmt: skip
    """Return what came out otherwise than it must in runs whose result is known beforehand."""
    found = []
    text = untrusted.read_python(package / module.path)
    if text is None:
        words = "it is in no encoding in which people write, so whether its reports are true cannot be tried"
        return [words] if any(test.outcome == "passed" for test in ran.tests) else []
    changed, names = canary.sabotage(text, ran.tests, chance)
    if names:
        files = {str(PACKAGE / module.path): changed}
        again = bench.run(Request(module.path, files=files, select=names, limit=seconds, total=seconds))
        found.append(canary.judge_sabotage(again, names))
    tests = canary.probed_tests(ran.tests, chance)
    # Broken functions may leave a test waiting for what never comes: no test needs longer than it did.
    limits = {test.id: 2.0 + 3 * test.seconds for test in ran.tests}
    texts = {path: text for path, (text, _) in sources.items()}
    for probe in canary.probes(texts, ran.reach, chance) if tests else []:
        files = {inside: text for path, text in probe.texts.items() for inside in sources[path][1]}
        again = bench.run(
            Request(module.path, files=files, select=tests, coverage=True, limits=limits, limit=20.0, total=seconds)
        )
        found.append(canary.judge_probe(again, probe))
    return [problem for problem in found if problem]


def _flags(doubts: Sequence[str], refused: set[tuple[str, str]]) -> list[Flag]:
    flags = [Flag("test reports", problem, where=problem.partition(":")[0]) for problem in doubts]
    for hook, where in sorted(refused):
        words = f"{where} has the hook {hook}, which can rewrite results; the grader's pytest does not call it"
        flags.append(Flag("pytest hook", words, where=where))
    return flags


def _readers(runs: Mapping[str, Ran]) -> list[Flag]:
    """Return a flag for each module with tests that use the package and read its source; a linter does only one."""
    flags = []
    for path, ran in runs.items():
        users = {name for lines in ran.reach.values() for names in lines.values() for name in names}
        both = sorted(test.id for test in ran.tests if test.id in users & ran.readers)
        if both:
            names = ", ".join(name.rpartition("::")[2][:100] for name in both[:5])
            words = f"{names} read the package's source as a text; what they notice of faults does not count"
            flags.append(Flag("source read", words, where=path))
    return flags


def _failures(ran: Ran) -> list[Test]:
    return [test for test in ran.tests if test.outcome in ("failed", "error")]


def _of_what_it_tests(module: TestModule, package: Path, ran: Ran) -> TestModule:
    """Return the module without the nodes that it has in its own name alone: neither its text nor its tests know them.

    Where conftest.py makes the node, the tests reach its lines.
    """
    text = untrusted.read_python(package / module.path) or ""
    reached = {Path(path).stem for path, lines in ran.reach.items() if lines}
    known = [node for node in module.subjects if node in reached or re.search(rf"\b{node}\b", text)]
    return replace(module, subjects=known)


def _results(module: TestModule, ran: Ran, passed_then: set[str]) -> TestModule:
    """Return the module with what a run reported. A test that was begun or collected and has no result is an error.

    A test that failed and is in `passed_then` counts as passed: it did when the whole module was run again.
    """
    unsteady = [test for test in _failures(ran) if test.id in passed_then]
    counts = Counter(test.outcome for test in ran.tests)
    counts.subtract(test.outcome for test in unsteady)
    counts["passed"] += len(unsteady)
    failures = [
        f"{test.id.rpartition('::')[2][:100]}: {' '.join(test.message.split())[:200]}"
        for test in _failures(ran)
        if test.id not in passed_then
    ]
    missing = max(0, (len(ran.collected) or module.tests) - len(ran.tests))
    if ran.late:
        # Only the one that ran out of time is to blame; those after it could not show what they can.
        reported = any(test.id == ran.late for test in ran.tests)
        missing = 0 if reported else 1
        failures += [] if reported else [f"{ran.late.rpartition('::')[2][:100]}: ran out of time"]
    elif ran.broken:
        missing = max(1, missing)
        failures.append(f"{module.path} could not be read by pytest: {ran.broken}")
    elif not ran.ended:
        missing = max(1, missing)
        failures.append(f"{module.path}: the process ended with status {ran.status} before pytest had finished")
    else:
        missing = 0
    return replace(
        module, passed=counts["passed"], failed=counts["failed"], errors=counts["error"] + missing,
        skipped=counts["skipped"], timed_out=bool(ran.late), failures=failures[:20],
        unsteady=[test.id.rpartition("::")[2][:100] for test in unsteady][:20], output_tail=ran.output_tail,
    )  # fmt: skip


def _reach(module: TestModule, ran: Ran) -> Reach:
    passed = [test for test in ran.tests if test.outcome == "passed" and not test.expected]
    # No test took longer than all of them together, whatever the report says: limits are made of these.
    seconds = {test.id: min(test.seconds, ran.seconds) for test in passed}
    return Reach(module.path, seconds, ran.reach, whole=ran.shared, readers=ran.readers)


def _probeable(package: Path, install: Path) -> dict[str, tuple[str, list[str]]]:
    """Return the modules whose text can be replaced wherever the tests may import them from: text, places."""
    found = {}
    for path, text in sources(package, install).items():
        if text is None:
            continue
        where = places(package, install, path, text)
        copies = [root / path for root in (install / ros_env.SITE_IN_PREFIX, package) if (root / path).is_file()]
        if where and len(where) == len(copies):
            found[path] = (text, where)
    return found
