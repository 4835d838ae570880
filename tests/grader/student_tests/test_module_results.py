"""What the runs of a test module say: which results are steady, which nodes are tested, which tests cannot fail."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pytest
from helpers.course import COURSE, NODES

from grader import evidence
from grader.student_tests import source
from grader.student_tests.module_results import ModuleRuns, flags
from grader.student_tests.warm_worker import ModuleRequest, WorkerPool
from grader.student_tests.worker_report import ModuleRun, TestResult

MODULE = evidence.TestModule("test/test_it.py", stub=False, tests=2, asserting=2)
FILE = "ros2_robot_controller/robot_controller.py"
FUNCTIONS = {FILE: frozenset(range(10, 100))}


def named(test: str) -> str:
    return f"{MODULE.path}::{test}" if test else ""


def ran(**outcomes: str) -> ModuleRun:
    tests = tuple(TestResult(named(name), outcome, "assert False") for name, outcome in outcomes.items())
    return ModuleRun(
        tests, tuple(test.id for test in tests), collection_error="", finished=True, status=0, timed_out="",
        running="", seconds=1.0, quiet_seconds=1.0, shares_fixtures=False, output_tail="", reach={},
    )  # fmt: skip


def reaching(run: ModuleRun, **lines: Sequence[int]) -> ModuleRun:
    """Return the run with the lines that each test reached; `shared` stands for none of them."""
    by_line: dict[int, frozenset[str]] = {}
    for test, reached in lines.items():
        for line in reached:
            by_line[line] = by_line.get(line, frozenset()) | {named("" if test == "shared" else test)}
    return replace(run, reach={FILE: by_line})


def results(run: ModuleRun, probe: ModuleRun | None, module: evidence.TestModule = MODULE) -> evidence.TestModule:
    return ModuleRuns(module, [run, run], probe, FUNCTIONS).results(NODES)


def test_a_test_that_fails_where_all_functions_raise_tests_the_files_that_it_runs():
    run = reaching(ran(test_it="passed"), test_it=[12])
    found = results(run, ran(test_it="failed"))
    assert (found.reached, found.tested, found.idle) == ([FILE], [FILE], [])


@pytest.mark.parametrize("outcome", ["passed", "skipped"])
def test_one_that_does_not_tests_nothing(outcome: str):
    run = reaching(ran(test_it="passed"), test_it=[12])
    found = results(run, ran(test_it=outcome))
    assert (found.reached, found.tested, found.idle) == ([FILE], [], ["test_it"] * (outcome == "passed"))


def test_importing_a_file_is_not_running_it():
    run = replace(reaching(ran(test_it="passed"), test_it=[1], shared=[12]), imported={FILE: frozenset({12})})
    found = results(run, ran(test_it="passed"))
    assert (found.reached, found.tested, found.idle) == ([], [], [])


def test_a_shared_fixture_tests_what_it_runs():
    run = reaching(ran(test_it="passed"), shared=[12])
    assert results(run, ran(test_it="error")).tested == [FILE]
    assert results(run, ran(test_it="passed")).tested == []


@pytest.mark.parametrize(
    "probe",
    [
        replace(ran(), collection_error="every function raises"),
        replace(ran(), timed_out=named("test_it"), finished=False),
        replace(ran(), running=named("test_it"), finished=False, status=-11),
    ],
)
def test_a_module_that_cannot_even_be_collected_or_a_test_that_hangs_or_crashes_has_failed(probe: ModuleRun):
    assert results(reaching(ran(test_it="passed"), test_it=[12]), probe).tested == [FILE]


def test_what_asserts_nothing_tests_nothing():
    run = reaching(ran(test_it="passed"), test_it=[12])
    assert results(run, ran(test_it="failed"), replace(MODULE, silent=["test_it"])).tested == []


def test_a_test_with_parameters_is_idle_if_none_of_its_cases_fails():
    run = replace(ran(), tests=tuple(TestResult(named(f"test_it[{n}]"), "passed") for n in range(3)))
    run = replace(run, reach={FILE: {12: frozenset(test.id for test in run.tests)}})
    assert results(run, run).idle == ["test_it"]
    one_fails = (TestResult(run.tests[0].id, "failed"), *run.tests[1:])
    found = results(run, replace(run, tests=one_fails))
    assert (found.idle, found.tested) == ([], [FILE])


def test_a_started_node_is_tested_if_a_test_fails_in_the_probe():
    run = replace(ran(test_it="passed"), started=frozenset({"ros2 run ros2_robot_controller robot_controller"}))
    assert results(run, ran(test_it="failed")).starts == ["robot_controller"]
    assert results(run, ran(test_it="passed")).starts == []


def test_many_lines_that_only_idle_tests_have_run_are_flagged():
    """A test that tells coverage that it ran every line passes whatever raises, and so do forged reports."""

    def found(claimed: Sequence[int], others: Sequence[int]) -> list[evidence.Flag]:
        run = reaching(ran(test_claims="passed", test_it="passed"), test_claims=claimed, test_it=others)
        return flags([ModuleRuns(MODULE, [run, run], ran(test_claims="passed", test_it="failed"), FUNCTIONS)])

    [flag] = found(range(1, 60), range(10, 20))
    assert (flag.kind, flag.where, flag.concerns) == ("test reports", MODULE.path, ["student tests"])
    assert flag.what == "40 lines were run by tests only that pass although all that they call raises: test_claims"
    assert found(range(1, 60), range(10, 40)) == []


def test_lines_are_claimed_by_a_test_that_passes_only_while_it_is_measured_too():
    """The second run and a plain probe showed nothing of a test that asked first whether coverage runs."""
    run = reaching(ran(test_claims="passed"), test_claims=range(1, 60))
    [flag] = flags([ModuleRuns(MODULE, [run, ran(test_claims="failed")], ran(test_claims="passed"), FUNCTIONS)])
    assert flag.kind == "test reports"


class ScriptedWorker:
    """Answers each request with the next of the given runs."""

    alive, out = True, Path("worker/out")

    def __init__(self, runs: Sequence[ModuleRun]) -> None:
        self.runs = iter(runs)

    def run(self, _request: ModuleRequest) -> ModuleRun:
        return next(self.runs)


def team_of(worker: ScriptedWorker) -> WorkerPool:
    return WorkerPool(lambda _number, _domain: worker, Path(), 1)  # type: ignore[arg-type,return-value]


@pytest.fixture
def own_tests(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    """Return a function from scripted runs to the module's results and the number of runs left over."""
    monkeypatch.setattr(source, "combine", lambda *_: [])

    def results(*runs: ModuleRun) -> tuple[evidence.TestModule, int]:
        worker = ScriptedWorker(runs)
        ran = source.run_suite(tmp_path, tmp_path, [MODULE], COURSE, workers=team_of(worker))
        (module,) = ran.tests.modules
        return module, len(list(worker.runs))

    return results


@pytest.mark.parametrize("first", ["failed", "passed"])
def test_a_test_that_passes_only_once_counts_neither_way_and_is_named(own_tests, first: str):
    """One that failed first counted as passed, one that passed first was not run again.

    Two nodes that do not discover each other in time are not the author's mistake: such a test costs nothing.
    """
    second = {"failed": "passed", "passed": "failed"}[first]
    module, _ = own_tests(
        ran(test_flickers=first, test_steady="passed"), ran(test_flickers=second, test_steady="passed"),
        ran(test_steady="failed"),
    )  # fmt: skip
    assert (module.passed, module.failed) == (1, 0)
    assert module.unsteady == ["test_flickers"]
    assert module.failures == []


@pytest.mark.usefixtures("own_tests")
@pytest.mark.parametrize("second", ["failed", "passed"])
def test_what_passes_only_while_it_is_measured_is_measured_in_the_probe_too(tmp_path: Path, second: str):
    requests: list[ModuleRequest] = []

    class Recording(ScriptedWorker):
        def run(self, request: ModuleRequest) -> ModuleRun:
            requests.append(request)
            return super().run(request)

    runs = [ran(test_claims="passed"), ran(test_claims=second), ran(test_claims="passed")]
    source.run_suite(tmp_path, tmp_path, [MODULE], COURSE, workers=team_of(Recording(runs)))
    assert [request.coverage for request in requests] == [True, False, second == "failed"]
    assert requests[-1].select == [named("test_claims")]


def test_a_test_that_fails_twice_has_failed(own_tests):
    module, unused = own_tests(
        ran(test_wrong="failed", test_broken="error"), ran(test_wrong="failed", test_broken="error")
    )
    assert (module.passed, module.failed, module.errors, unused) == (0, 1, 1, 0)
    assert module.unsteady == []
    assert [failure.partition(":")[0] for failure in module.failures] == ["test_wrong", "test_broken"]


def test_a_module_that_hangs_is_not_run_again(own_tests):
    _, unused = own_tests(replace(ran(test_it="failed"), timed_out="test_it"), ran(test_it="passed"))
    assert unused == 1


@pytest.mark.usefixtures("own_tests")
def test_the_longest_module_begins_first_and_the_results_keep_their_order(tmp_path: Path):
    modules = [
        replace(MODULE, path=f"test/test_{name}.py", tests=tests) for name, tests in (("a", 1), ("b", 3), ("c", 2))
    ]
    begun: list[str] = []

    class Recording(ScriptedWorker):
        def run(self, request: ModuleRequest) -> ModuleRun:
            begun.append(request.module)
            return ran(test_it="passed")

    found = source.run_suite(tmp_path, tmp_path, modules, COURSE, workers=team_of(Recording([])))
    assert list(dict.fromkeys(begun)) == ["test/test_b.py", "test/test_c.py", "test/test_a.py"]
    assert [module.path for module in found.tests.modules] == [module.path for module in modules]
    assert [reach.module for reach in found.reach] == [module.path for module in modules]
