"""Workers are forks of one process, each in a network of its own; where that is not allowed, bubblewrap starts them."""

from __future__ import annotations

import os
import signal
import subprocess
import textwrap
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing
from pathlib import Path

import pytest
from helpers.course import COURSE
from helpers.programs import ENDS_WITH_MANY_STACKS
from helpers.ros2_runs import until

from grader import KIT, building
from grader.errors import GraderError
from grader.trials import scheduler
from grader.trials.worker_start import ForkedWorker, Worker, Workers

pytestmark = [pytest.mark.ros, pytest.mark.sandbox]


@pytest.fixture
def make(contract: building.Built, tmp_path: Path) -> Iterator[Callable[[str], Workers]]:
    """Return a function that makes Workers, each of whose processes runs some code first."""
    with ExitStack() as stack:

        def make(code: str = "") -> Workers:
            tmp_path.joinpath("sitecustomize.py").write_text(code)
            environment = scheduler.observer_environment(contract.install, home=tmp_path)
            environment["PYTHONPATH"] = f"{tmp_path}:{KIT}:{environment['PYTHONPATH']}"
            return stack.enter_context(closing(Workers(COURSE.folder, environment, tmp_path)))

        yield make


def forked(workers: Workers) -> ForkedWorker:
    """Return a worker that was forked."""
    worker = workers.start("any")
    assert isinstance(worker, ForkedWorker)
    return worker


def end(worker: Worker) -> int:
    """Tell a worker that there are no more requests, and return its exit status."""
    assert worker.stdin is not None
    assert worker.stdout is not None
    worker.stdin.close()
    status = worker.wait(60)
    assert worker.stdout.read() == ""
    worker.stdout.close()
    return status


def network(pid: int | str) -> str:
    """Return the network namespace of a process."""
    return str(Path(f"/proc/{pid}/ns/net").readlink())


def test_workers_share_no_network_with_each_other_or_with_us(make):
    workers = make()
    first, second = forked(workers), forked(workers)
    assert len({network(first.pid), network(second.pid), network("self")}) == 3
    devices = Path(f"/proc/{first.pid}/net/dev").read_text().splitlines()[2:]
    assert [line.split(":")[0].strip() for line in devices] == ["lo"]
    assert "127.0.0.1" in Path(f"/proc/{first.pid}/net/fib_trie").read_text()
    if os.geteuid() != 0:  # a user makes the network in a user namespace, with every capability in it
        assert "CapEff:\t0000000000000000" in Path(f"/proc/{first.pid}/status").read_text()
    assert (end(first), end(second)) == (0, 0)


@pytest.mark.slow  # one more process to fork from
def test_a_worker_that_is_killed_says_so(make):
    worker = forked(make())
    with pytest.raises(subprocess.TimeoutExpired):
        worker.wait(0)
    worker.kill()
    assert end(worker) == -signal.SIGKILL
    worker.kill()  # there is nothing left to kill


def test_another_worker_can_be_started_after_a_crash(make):
    workers = make()
    first = forked(workers)
    os.kill(first.pid, signal.SIGSEGV)
    assert end(first) == -signal.SIGSEGV
    assert end(forked(workers)) == 0


@pytest.mark.slow  # one more process to fork from
def test_a_worker_exits_as_well_when_many_threads_have_ended(make):
    """It exits with the threads of DDS gone, and crashed then as the nodes did: see docs/ros-from-wheels.md."""
    text = textwrap.dedent(ENDS_WITH_MANY_STACKS)
    code = f"import sys\nend = sys.exit\nsys.exit = lambda *status: (exec({text!r}, {{}}), end(*status))"
    assert end(forked(make(code))) == 0


@pytest.mark.slow  # one more process to fork from
def test_no_worker_outlives_what_it_was_forked_from(make):
    workers = make()
    worker = forked(workers)
    workers.close()
    assert worker.wait(60) == -signal.SIGKILL
    assert end(worker) == -signal.SIGKILL
    until(lambda: not Path(f"/proc/{worker.pid}").exists())


NO_NAMESPACES = """
from grader.host import namespaces

def enter_private_network():
    raise PermissionError("no namespaces")

namespaces.enter_private_network = enter_private_network
"""


@pytest.mark.slow  # one more process to fork from
def test_bubblewrap_starts_workers_where_they_may_make_no_namespaces(make):
    workers = make(NO_NAMESPACES)
    first, second = workers.start("first"), workers.start("second")
    assert isinstance(first, subprocess.Popen)
    assert (end(first), end(second)) == (0, 0)


def test_what_keeps_workers_from_starting_is_told(make):
    with pytest.raises(GraderError, match=r"(?s)The trial worker did not start:.*no such luck.*Run `grader doctor`\."):
        make("raise SystemExit('no such luck')").start("any")
