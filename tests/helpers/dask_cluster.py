"""A Dask scheduler, and workers of it, started by their own commands as an administrator starts them."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from grader import KIT


@contextmanager
def dask_cluster(
    folder: Path, workers: int, *options: str, of_one: Mapping[str, str] | None = None
) -> Iterator[tuple[str, list[subprocess.Popen[bytes]]]]:
    """Start a scheduler and workers as their commands do; yield the scheduler's address and the workers.

    Their temporary files are in the folder `tmp`. `of_one` is the first worker's own environment.
    """
    file = folder / "scheduler.json"
    (folder / "tmp").mkdir()
    environment = os.environ | {"PYTHONPATH": str(KIT), "TMPDIR": str(folder / "tmp")}
    common = ["--host", "127.0.0.1", "--no-dashboard", "--scheduler-file", str(file)]

    def start(*words: str, more: Mapping[str, str] | None = None) -> subprocess.Popen[bytes]:
        return subprocess.Popen(
            [sys.executable, "-m", "dask", *words, *common],
            cwd=folder, env=environment | dict(more or {}), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip

    started = [start("scheduler", "--port", "0")]
    started += [
        start("worker", "--nthreads", "1", *options, more=None if number else of_one) for number in range(workers)
    ]
    try:
        wait_until("the scheduler has started", lambda: file.exists() and bool(file.read_text().strip()))
        address = json.loads(file.read_text())["address"]
        if workers:
            wait_for_workers(address, workers)
        yield address, started[1:]
    finally:
        for process in reversed(started):
            process.terminate()
            process.wait(30)


def wait_for_workers(address: str, number: int) -> None:
    """Wait until the scheduler at `address` has so many workers."""
    from distributed import Client

    with Client(address, timeout=60) as client:
        client.wait_for_workers(number, timeout=120)


def wait_until(what: str, holds: Callable[[], bool]) -> None:
    """Wait until `holds` does, at most two minutes."""
    deadline = time.monotonic() + 120
    while not holds():
        assert time.monotonic() < deadline, f"not in time: {what}"
        time.sleep(0.1)  # nothing tells when a file appears or a process ends
