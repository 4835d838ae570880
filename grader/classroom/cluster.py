"""Grade on a Dask cluster: submissions travel as bytes and results come back, so the machines share no disk."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

from grader.classroom.class_folder import Status
from grader.classroom.one_grading import Ending, Order, Runner, Workforce, grade_packed, pack, unpack_results
from grader.course import named
from grader.errors import GraderError
from grader.host import provenance

_CONNECT_S = 15
_LOOK_S = 0.5  # between two looks of a worker at whether its grading is still wanted


def _grade(executor: Executor, order: Order) -> Ending:
    """Grade a submission on a worker; its results are in `order.out` in the end."""
    source = Path(order.source)
    try:
        archive = pack(source) if source.is_dir() else source.read_bytes()
        sent = asdict(order) | {"source": source.name, "out": ""}
        future = executor.submit(grade_while_wanted, sent, archive, source.is_dir())
        status, why, seconds, results = future.result()
        unpack_results(results, Path(order.out))
        return Ending(Status(status), why, seconds)
    except Exception as error:  # of many kinds: Dask's own, the network's
        return Ending(Status.ERROR, f"The cluster did not grade it: {type(error).__name__}: {error}")


def grade_while_wanted(order: dict[str, object], archive: bytes, folder: bool) -> tuple[str, str, float, bytes]:
    """Do what `grade_packed` does, as a task of a Dask worker; end it when the task is cancelled or the worker closes.

    Dask itself lets a function that runs go on to its end. A client that is killed cancels its tasks, too.
    """
    from distributed import Status as WorkerStatus
    from distributed import get_worker

    worker: Any = get_worker()
    task, runner, over = worker.get_current_task(), Runner(), threading.Event()

    def watch() -> None:
        while not over.wait(_LOOK_S):
            state = worker.state.tasks.get(task)
            closing = worker.status in (WorkerStatus.closing, WorkerStatus.closed)
            if closing or state is None or state.state == "cancelled":
                runner.stop()
                return

    watcher = threading.Thread(target=watch, daemon=True)
    watcher.start()
    try:
        return grade_packed(order, archive, folder, runner)
    finally:
        over.set()
        watcher.join()


def _kit_hash(course: str) -> str:
    return provenance.kit_hash(named(course).layers)


@contextmanager
def workforce(address: str, kit: str, course: str = "") -> Iterator[Workforce]:
    """Yield what grades on the cluster of the scheduler at `address`.

    Raises:
        GraderError: Dask is not installed, the scheduler does not answer, has no workers, or they have another kit.
    """
    try:
        from distributed import Client
    except ImportError:
        raise GraderError("--scheduler needs Dask: pip install 'distributed', here and on the workers.") from None
    try:
        client: Any = Client(address, timeout=_CONNECT_S)  # type: ignore[no-untyped-call]  # Dask has no types
    except (OSError, ValueError) as error:
        raise GraderError(
            f"The scheduler {address} does not answer ({error}). Start it with `dask scheduler`."
        ) from error
    try:
        threads = client.nthreads()
        if not threads:
            raise GraderError(
                f"The scheduler {address} has no workers. Start some with `dask worker {address} --nthreads 1`."
            )
        others = sorted(worker for worker, found in client.run(_kit_hash, course).items() if found != kit)
        if others:
            raise GraderError(
                f"These workers have another version of the kit: {', '.join(others)}. "
                "Install the same one everywhere, so that all submissions are graded alike."
            )
        executor = client.get_executor(pure=False)
        # Each of the threads waits for one result of the cluster and writes it to this machine's disk. Dask cancels
        # what is pending when its executor ends, and each worker then ends its grading as soon as it notices.
        cluster = Workforce(
            sum(threads.values()), partial(_grade, executor), partial(executor.shutdown, wait=False), "on the cluster"
        )
        try:
            yield cluster
        finally:
            cluster.stop()
    finally:
        client.close()
