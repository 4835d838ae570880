"""A process that is started for the next task: it is taken once, in the surroundings that it began in, and gives up."""

from __future__ import annotations

import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from helpers.ros2_runs import until

from grader.notebook.spare_process import SpareProcess

ECHO = ("-c", "import os, sys; print(sys.stdin.read(), os.environ.get('WORD', ''))")


@pytest.fixture
def make() -> Iterator[Callable[..., SpareProcess]]:
    """Return a function that makes a SpareProcess which repeats its task."""
    made: list[SpareProcess] = []

    def make(*, idle_s: float = 600.0) -> SpareProcess:
        made.append(SpareProcess(ECHO, Path("/nowhere"), idle_s))
        return made[-1]

    yield make
    for each in made:
        if (waiting := waiting_of(each)) is not None:
            answer(waiting)


def waiting_of(spare: SpareProcess) -> subprocess.Popen[str] | None:
    return spare._waiting


def answer(process: subprocess.Popen[str], task: str = "task") -> str:
    return process.communicate(task, timeout=60.0)[0]


def test_without_one_that_waits_a_process_is_started(make):
    assert answer(make().take(), "F4") == "F4 \n"


def test_the_one_that_waits_is_taken_once(make):
    spare = make()
    spare.prepare()
    waiting = waiting_of(spare)
    spare.prepare()
    assert waiting_of(spare) is waiting
    assert spare.take() is waiting
    assert waiting_of(spare) is None
    assert answer(waiting) == "task \n"
    other = spare.take()
    assert other is not waiting
    answer(other)


def test_in_another_environment_a_new_one_is_started(make, monkeypatch):
    spare = make()
    spare.prepare()
    waiting = waiting_of(spare)
    monkeypatch.setenv("WORD", "changed")
    assert answer(spare.take()) == "task changed\n"
    assert waiting.returncode is not None


def test_in_another_folder_a_new_one_is_started(make, monkeypatch, tmp_path):
    spare = make()
    spare.prepare()
    waiting = waiting_of(spare)
    monkeypatch.chdir(tmp_path)
    taken = spare.take()
    assert taken is not waiting
    answer(taken)


def test_without_room_for_it_none_waits(make, monkeypatch):
    spare = make()

    def no_room(*_: object, **__: object) -> subprocess.Popen[str]:
        raise BlockingIOError

    with monkeypatch.context() as patched:
        patched.setattr(subprocess, "Popen", no_room)
        spare.prepare()
    assert waiting_of(spare) is None
    assert answer(spare.take()) == "task \n"


def test_in_place_of_one_that_was_killed_a_new_one_is_started(make):
    spare = make()
    spare.prepare()
    waiting = waiting_of(spare)
    waiting.kill()
    waiting.wait()
    assert answer(spare.take()) == "task \n"


def test_one_that_nobody_needs_is_ended(make):
    spare = make(idle_s=0.0)
    spare.prepare()
    until(lambda: waiting_of(spare) is None, 60.0)
    assert answer(spare.take()) == "task \n"


def test_it_ends_with_its_input(make):
    """As when the kernel that has started it is killed."""
    spare = make()
    spare.prepare()
    taken = spare.take()
    assert answer(taken, "") == " \n"
    assert taken.returncode == 0
