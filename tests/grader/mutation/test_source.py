"""A real package is mutated in a real sandbox; suites of several kinds notice the mutants, or pretend to."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from textwrap import dedent, indent
from types import SimpleNamespace

import pytest
from helpers.course import COURSE
from submissions import toy

from grader.evidence import Mutation
from grader.mutation.jobs import Job, TestedPackage, run_job
from grader.mutation.selection import Selection
from grader.mutation.source import mutate
from grader.student_tests.discover import discover_tests
from grader.student_tests.module_results import ModuleReach
from grader.student_tests.source import run_suite
from grader.student_tests.worker_report import read_run

pytestmark = [pytest.mark.sandbox]

REACHING = """
    from ros2_robot_controller import robot_controller, sensor_processor

    def use():
        robot = robot_controller.RobotController()
        robot.set_speed(0.3)
        robot.set_speed(3.0)
        robot.on_scan(1.0)
        robot.on_scan(0.1)
        robot_controller.stop_distance(0.5)
        sensor_processor.percent(0.5)
        sensor_processor.percent(5.0)
"""
SUITES = {
    "thorough": toy.THOROUGH,
    "silent": """
        {reaching}
        def test_it_runs():
            use()
    """,
}
Mutate = Callable[..., Mutation]


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> toy.Toy:
    reaching = indent(dedent(REACHING), " " * 8).strip()
    files = {f"test/{name}/test_it.py": dedent(text.replace("{reaching}", reaching)) for name, text in SUITES.items()}
    return toy.make(tmp_path_factory.mktemp("toy"), files)


@pytest.fixture(scope="module")
def reach(made: toy.Toy) -> dict[str, ModuleReach]:
    found = run_suite(made.package, made.install, discover_tests(made.package, COURSE.nodes), COURSE)
    assert [module.failures for module in found.tests.modules] == [[]] * len(SUITES)
    return {reach.module.split("/")[1]: reach for reach in found.reach}


@pytest.fixture(scope="module")
def mutated(made: toy.Toy, reach: dict[str, ModuleReach]) -> Mutate:
    return cache(
        lambda suite, count: mutate(made.package, made.install, [reach[suite]], COURSE, seconds=60.0, count=count)
    )


def outcomes(mutation: Mutation) -> list[str]:
    return [mutant.outcome for mutant in mutation.mutants]


@pytest.mark.slow  # all mutants of the toy
def test_thorough_tests_notice_nearly_every_mutant_that_they_reach_and_no_equivalent_one(mutated: Mutate):
    mutation = mutated("thorough", 30)
    assert sum(mutant.outcome != "unreached" for mutant in mutation.mutants) == 30
    unnoticed = [f"{m.line} {m.words}" for m in mutation.mutants if m.outcome == "unnoticed"]
    assert len(unnoticed) <= 2, unnoticed
    assert (mutation.convicted, mutation.set_aside, mutation.note) == ([], [], "")
    unreached = [mutant.function for mutant in mutation.mutants if mutant.outcome == "unreached"]
    assert len(unreached) >= 3
    assert set(unreached) == {"never_called"}
    assert len(mutation.equivalent_mutants) >= 6
    assert not any(equivalent.failed for equivalent in mutation.equivalent_mutants)


def test_a_mutant_names_the_test_that_noticed_it_or_those_that_passed(mutated: Mutate):
    mutants = mutated("thorough", 6).mutants + mutated("silent", 6).mutants
    assert {"noticed", "unnoticed"} <= {mutant.outcome for mutant in mutants}
    for mutant in mutants:
        if mutant.outcome == "noticed":
            assert mutant.by.startswith("test/")
        if mutant.outcome == "unnoticed":
            assert mutant.tried


def test_tests_that_assert_nothing_notice_nothing(mutated: Mutate):
    assert outcomes(mutated("silent", 6)).count("noticed") == 0


def test_without_tests_every_mutant_is_unreached(made: toy.Toy):
    mutation = mutate(made.package, made.install, [], COURSE)
    assert set(outcomes(mutation)) == {"unreached"}


def test_a_test_sees_a_changed_module_as_it_sees_the_original(tmp_path: Path):
    """No variable, no file and no time stamp shows that a module is mutated; only its behaviour does."""
    text = """
        import os
        import sys
        from ros2_robot_controller import robot_controller as module

        def test_no_marker():
            module.stop_distance(1.0)
            assert os.stat(module.__file__).st_mtime_ns == {mtime}
            assert module.__file__.startswith("/ws/install/")
            assert not [name for name in os.environ if "FAULT" in name or "MUTA" in name]
            assert os.listdir("/ws/requests") == ["settings.json"]
            assert [name for name in os.listdir("/tmp") if not sys.prefix.startswith("/tmp/" + name + "/")] == []
            assert sorted(os.listdir("/ws/package")) == ["ros2_robot_controller", "scripts", "test"]
    """
    made = toy.make(tmp_path, {"test/test_it.py": "\n"})
    mtime = (next(made.install.rglob("site-packages")) / "ros2_robot_controller/robot_controller.py").stat().st_mtime_ns
    (made.package / "test/test_it.py").write_text(dedent(text.format(mtime=mtime)))
    found = run_suite(made.package, made.install, discover_tests(made.package, COURSE.nodes), COURSE)
    assert found.tests.modules[0].failures == []
    mutation = mutate(made.package, made.install, found.reach, COURSE, count=10)
    assert "noticed" not in outcomes(mutation)
    assert "unnoticed" in outcomes(mutation)


def test_a_run_whose_worker_was_lost_notices_nothing(tmp_path: Path):
    lost = replace(read_run(tmp_path, 0, 1.0), worker_lost=True)
    workers = SimpleNamespace(run=lambda _request: lost)
    package = TestedPackage({}, {}, {"test_it.py": ModuleReach("test_it.py", {"test_it.py::test_it": 0.1}, {})})
    job = Job(None, (Selection("test_it.py", ("test_it.py::test_it",)),))
    assert lost.failure
    assert run_job(workers, package, job).noticed_by == ""  # type: ignore[arg-type]
