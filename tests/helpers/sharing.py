"""How the tests are shared out among processes.

With `-n 2 --dist loadfile`, as `make test` runs them, each file stays in one of pytest-xdist's processes, so that a
fixture of a file is made once. Each process has temporary folders of its own.
"""

from __future__ import annotations

import gc
import os
import signal
from typing import Any

import pytest

ONE_NETWORK = (
    "tests/notebooks/test_notebook_runs.py",
    "tests/grader/notebook/test_session.py",
    "tests/grader/notebook/test_bench.py",
    "tests/grader/notebook/test_lessons.py",
    "tests/grader/notebook/test_clinic.py",
    "tests/grader/notebook/test_graph_view.py",
    "tests/grader/trials/test_service_proxy.py",
    "tests/grader/trials/test_messages.py",
)
"""Files whose nodes use this machine's own network. They run one after the other, in one process, so that no test
meets the nodes of another. All others start theirs in networks of their own."""

DEAR = (
    *ONE_NETWORK,
    "tests/grader/test_grading.py",
    "tests/grader/building/test_colcon.py",
    "tests/grader/classroom/test_class_memory.py",
    "tests/grader/test_held_back.py",
    "tests/grader/trials/test_observers.py",
    "tests/grader/trials/test_late_discovery.py",
    "tests/grader/classroom/test_batch.py",
)
"""The files that take longest. They begin first: the last to begin runs while other cores have nothing to do."""

_GIVES_WAY = 4
"""The niceness of all other processes: the files of ONE_NETWORK, one after the other, take longer than the rest."""

_begun: set[str] = set()


def pytest_configure(config: pytest.Config) -> None:
    """Let SIGINT interrupt the tests and what they start: a shell has it ignored in what it runs in the background."""
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers() -> int:
    """Return how many processes `-n auto` starts: two for each core, since tests often wait."""
    return len(os.sched_getaffinity(0)) * 2


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """Share out by file where that is asked for."""
    from xdist.scheduler import LoadFileScheduling

    class ByFile(LoadFileScheduling):  # type: ignore[misc]
        def _split_scope(self, nodeid: str) -> str:
            return scope(nodeid)

    config.option.loadscopereorder = False  # xdist would begin with the files of the most tests
    return ByFile(config, log) if config.option.dist == "loadfile" else None


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    """Let a process that does not begin with ONE_NETWORK give way to the one that does."""
    if "PYTEST_XDIST_WORKER" in os.environ and not _begun and scope(item.nodeid) != "one network":
        os.nice(_GIVES_WAY - os.nice(0))
    _begun.add(item.nodeid)


def scope(nodeid: str) -> str:
    """Return what must run in one process: the file of a test, or all of ONE_NETWORK."""
    file = nodeid.partition("::")[0]
    return "one network" if file in ONE_NETWORK else file


@pytest.hookimpl(tryfirst=True)
def pytest_collection() -> None:
    """Look for no garbage while the tests are imported: there is none, and each process would spend 4 s on that."""
    gc.disable()


@pytest.hookimpl(trylast=True)
def pytest_collection_finish() -> None:
    """Look for garbage again, but never among what has been imported."""
    gc.freeze()
    gc.enable()


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Put the files of DEAR first."""
    items.sort(key=lambda item: rank(item.nodeid))


def rank(nodeid: str) -> int:
    """Return which turn the file of a test has."""
    file = nodeid.partition("::")[0]
    return DEAR.index(file) if file in DEAR else len(DEAR)
