"""Tests that run on a mutant find the mutant in their sandbox, and nothing of the original."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from helpers import beside
from submissions import toy

from grader.student_tests.package_modules import MODULES, PACKAGE
from grader.student_tests.warm_worker import ModuleRequest, WorkerPool, start_workers
from grader.student_tests.worker_report import ModuleRun

TEXTS = beside(__file__)

NODE = "ros2_robot_controller/robot_controller.py"
SOURCES = [str(root / NODE) for root in (PACKAGE, MODULES)]


# Each looks for a text that it does not have itself, in whatever it can reach.
@pytest.fixture(scope="module")
def worker(tmp_path_factory: pytest.TempPathFactory) -> Iterator[WorkerPool]:
    """A worker whose tests have run on the original before."""
    made = toy.make(tmp_path_factory.mktemp("toy"), {"test/test_looks.py": TEXTS["LOOKS"]})
    with start_workers(made.package, made.install) as worker:
        worker.run(ModuleRequest("test/test_looks.py", coverage=True))
        yield worker


@pytest.fixture(scope="module")
def on_a_mutant(worker: WorkerPool) -> ModuleRun:
    mutant = toy.CONTROLLER.replace("braking = 2.0", "braking = 4.0")
    return worker.run(ModuleRequest("test/test_looks.py", files=dict.fromkeys(SOURCES, mutant)))


@pytest.mark.sandbox
def test_a_mutants_process_and_sandbox_hold_nothing_of_the_original(on_a_mutant: ModuleRun):
    """A fixture that walked the frames to both texts noticed 40 of 40 mutants without any assert that could fail."""
    assert [(test.id.rpartition("::")[2], test.message) for test in on_a_mutant.tests if test.outcome != "passed"] == []
    assert len(on_a_mutant.tests) == 7


@pytest.mark.sandbox
def test_after_a_mutant_the_original_is_back(worker: WorkerPool, on_a_mutant: ModuleRun):
    ran = worker.run(ModuleRequest("test/test_looks.py", select=["test/test_looks.py::test_files"]))
    assert [test.outcome for test in ran.tests] == ["failed"]
