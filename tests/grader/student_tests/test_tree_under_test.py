"""Tests that run on a mutant find the mutant in their sandbox, and nothing of the original."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from submissions import toy

from grader.student_tests.package_modules import MODULES, PACKAGE
from grader.student_tests.warm_worker import ModuleRequest, WorkerPool, start_workers
from grader.student_tests.worker_report import ModuleRun

NODE = "ros2_robot_controller/robot_controller.py"
SOURCES = [str(root / NODE) for root in (PACKAGE, MODULES)]
# Each looks for a text that it does not have itself, in whatever it can reach.
LOOKS = """
import gc
import os
import re
import sys
from pathlib import Path

from ros2_robot_controller import robot_controller

ORIGINAL = re.compile(rb"braking [=] 2[.]0")
MUTANT = re.compile(rb"braking [=] 4[.]0")


def texts(things):
    waiting, seen = list(things), set()
    for thing in waiting:
        if isinstance(thing, str | bytes):
            yield thing.encode("utf-8", "replace") if isinstance(thing, str) else thing
        elif isinstance(thing, dict | list | tuple | set) and id(thing) not in seen and len(thing) < 100000:
            seen.add(id(thing))
            waiting += [*thing.keys(), *thing.values()] if isinstance(thing, dict) else thing


def frames():
    frame = sys._getframe()
    while frame:
        yield frame.f_locals
        frame = frame.f_back


def memory(process):
    with open(f"/proc/{process}/maps") as maps, open(f"/proc/{process}/mem", "rb") as mem:
        for line in maps:
            where, rights = line.split()[:2]
            if "r" in rights and "w" in rights and "vvar" not in line:
                first, last = (int(word, 16) for word in where.split("-"))
                try:
                    mem.seek(first)
                    yield mem.read(last - first)
                except (OSError, ValueError):
                    continue


def files():
    for here, _, names in os.walk("/ws"):
        for name in names:
            path = Path(here, name)
            if path.is_file() and path.suffix in (".py", ".pyc", ".json", ".tree", ".taken"):
                yield path.read_bytes()


def test_frames_and_objects():
    assert robot_controller.stop_distance(0.0) == 0.0
    assert not any(ORIGINAL.search(text) for text in texts([*frames(), *gc.get_objects()]))


def test_memory():
    assert not any(ORIGINAL.search(text) for text in memory("self"))


def test_the_parents_memory():
    try:
        assert not any(ORIGINAL.search(text) for text in memory(os.getppid()))
    except PermissionError:
        pass


def test_files():
    found = list(files())
    assert any(MUTANT.search(text) for text in found)
    assert not any(ORIGINAL.search(text) for text in found)


def test_byte_code_is_there_for_all_modules_or_none():
    cache = Path(robot_controller.__file__).parent / "__pycache__"
    names = {path.name.partition(".")[0] for path in cache.iterdir()}
    assert names >= {"__init__", "robot_controller", "sensor_processor"}


def test_the_times_of_files():
    folder = Path(robot_controller.__file__).parent
    changed = sorted(path.stat().st_ctime_ns for path in folder.glob("*.py"))
    assert changed[-1] - changed[0] < 10**9
    assert len({path.stat().st_mtime_ns // 10**9 for path in folder.glob("*.py")}) <= 2


def test_nothing_is_left_by_an_earlier_run():
    places = [Path(place, "left") for place in ("/tmp", "/ws/out", "/ws/package", "/ws/package/test", "/dev/shm")]
    found = [path for path in places if path.exists()]
    for path in places:
        path.mkdir(exist_ok=True)
    assert found == []
"""


@pytest.fixture(scope="module")
def worker(tmp_path_factory: pytest.TempPathFactory) -> Iterator[WorkerPool]:
    """A worker whose tests have run on the original before."""
    made = toy.make(tmp_path_factory.mktemp("toy"), {"test/test_looks.py": LOOKS})
    with start_workers(made.package, made.install, 1, seconds=300.0) as worker:
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
