"""Grade on a Dask cluster: submissions travel as bytes and results come back, so the machines share no disk."""

from __future__ import annotations

import io
import threading
import zipfile
from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from grader.classroom.class_folder import Status
from grader.classroom.one_grading import Ending, Order, Runner, Workforce
from grader.course import named
from grader.errors import GraderError
from grader.host import provenance, tempdir

_CONNECT_S = 15
_LOOK_S = 0.5  # between two looks of a worker at whether its grading is still wanted


def _grade(executor: Executor, order: Order) -> Ending:
    """Grade a submission on a worker; its results are in `order.out` in the end."""
    source = Path(order.source)
    try:
        archive = pack(source) if source.is_dir() else source.read_bytes()
        sent = replace(order, source=source.name)
        ending, results = executor.submit(grade_while_wanted, sent, archive, source.is_dir()).result()
        unzip(results, Path(order.out))
        return ending
    except Exception as error:  # of many kinds: Dask's own, the network's
        return Ending(Status.ERROR, f"The cluster did not grade it: {type(error).__name__}: {error}")


def grade_while_wanted(order: Order, archive: bytes, folder: bool) -> tuple[Ending, bytes]:
    """Grade a submission that travels as bytes, and return how that ended and a zip of the results.

    This is a task of a Dask worker, which shares no disk with the caller; `folder` says that the archive is a packed
    folder. It ends when the task is cancelled or the worker closes: Dask itself lets a function that runs go on to its
    end. A client that is killed cancels its tasks, too.
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
        with tempdir.folder("batch") as scratch:
            source, out = scratch / "in" / order.source, scratch / "out"
            out.mkdir()
            source.parent.mkdir(parents=True)
            if folder:
                unzip(archive, source)
            else:
                source.write_bytes(archive)
            ending = runner.grade(replace(order, source=str(source), out=str(out)), scratch)
            return ending, pack(out)
    finally:
        over.set()
        watcher.join()


def pack(folder: Path) -> bytes:
    """Return the files of a folder as a zip; links and special files are left out."""
    stream = io.BytesIO()
    # A zip has no times before 1980; a file from a reproducible build may be of 1970.
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED, compresslevel=1, strict_timestamps=False) as packed:
        for path in sorted(folder.rglob("*")):
            if path.is_file() and not path.is_symlink() and ".git" not in path.relative_to(folder).parts:
                packed.write(path, path.relative_to(folder).as_posix())
    return stream.getvalue()


def unzip(packed: bytes, into: Path) -> None:
    """Write what `pack` returned into the folder `into`, which need not exist."""
    into.mkdir(parents=True, exist_ok=True)
    with zipfile.ZipFile(io.BytesIO(packed)) as archive:
        archive.extractall(into)  # of our own making; zipfile drops ".." and absolute paths
        for entry in archive.infolist():  # and modes, without which an executable is none
            (into / entry.filename).chmod(entry.external_attr >> 16 & 0o777)


def _kit_hash(course: str) -> str:
    return provenance.kit_hash(named(course).folder)


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
