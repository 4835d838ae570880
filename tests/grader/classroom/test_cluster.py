"""Grading a class on a Dask cluster: no shared disk, the same results."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from helpers import until
from helpers.archives import write
from helpers.class_reports import Silent

from grader import KIT
from grader.classroom import batch, cluster
from grader.classroom.class_folder import ClassFolder, Status
from grader.classroom.one_grading import Order, Workforce
from grader.classroom.plan import Options
from grader.course import kits_own
from grader.errors import GraderError
from grader.host import procfs, provenance
from grader.scoring import rubric

pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("default")]  # a cluster of three processes


@contextmanager
def dask_cluster(folder: Path, workers: int, *options: str) -> Iterator[tuple[str, list[subprocess.Popen[bytes]]]]:
    """Start a scheduler and workers by their own commands; yield the scheduler's address and the workers.

    Their temporary files are in the folder `tmp`.
    """
    from distributed import Client

    file = folder / "scheduler.json"
    (folder / "tmp").mkdir()
    environment = os.environ | {"PYTHONPATH": str(KIT), "TMPDIR": str(folder / "tmp")}
    common = ["--host", "127.0.0.1", "--no-dashboard", "--scheduler-file", str(file)]

    def start(*words: str) -> subprocess.Popen[bytes]:
        return subprocess.Popen(
            [sys.executable, "-m", "dask", *words, *common],
            cwd=folder, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip

    started = [start("scheduler", "--port", "0")]
    started += [start("worker", "--nthreads", "1", *options) for _ in range(workers)]
    try:
        until(lambda: file.exists() and file.read_text().strip())
        address = json.loads(file.read_text())["address"]
        with Client(address, timeout=60) as client:
            client.wait_for_workers(workers, timeout=120)
        yield address, started[1:]
    finally:
        for process in reversed(started):
            process.terminate()
            process.wait(30)


@pytest.fixture(scope="module")
def scheduler(tmp_path_factory) -> Iterator[str]:
    """Return the address of a scheduler with two workers."""
    with dask_cluster(tmp_path_factory.mktemp("dask"), 2) as (address, _):
        yield address


@pytest.mark.sandbox
def test_submissions_travel_to_the_workers_and_results_come_back(scheduler, tmp_path):
    write(tmp_path / "source", {f"{name}/notes.txt": "no package" for name in ("team01", "team02", "team03")})
    summary = batch.run(tmp_path / "source", tmp_path / "class", [], Options(scheduler=scheduler), Silent())
    assert (summary.entries, summary.refused, summary.errors) == (3, 3, 0)
    folder = ClassFolder(tmp_path / "class")
    record = folder.record("team02")
    assert record is not None
    assert record.status is Status.REFUSED
    assert (folder.submission("team02") / "report.html").exists(), "a refusal's report comes back too"


def test_workers_with_another_kit_are_refused(scheduler):
    with pytest.raises(GraderError, match="another version of the kit"), cluster.workforce(scheduler, "0" * 16):
        pass


def test_a_scheduler_that_does_not_answer_is_a_sentence(monkeypatch):
    monkeypatch.setattr(cluster, "_CONNECT_S", 1)
    nobody = cluster.workforce("tcp://127.0.0.1:9", provenance.kit_hash(kits_own().folder))
    with pytest.raises(GraderError, match=r"does not answer .* `dask scheduler`"), nobody:
        pass


@contextmanager
def grading(folder: Path) -> Iterator[tuple[Workforce, subprocess.Popen[bytes], set[int]]]:
    """Yield a cluster whose only worker is grading the reference, the worker, and the processes below it."""
    (folder / "out").mkdir()
    package = KIT / "solution_pkg" / "ros2_robot_controller"
    order = Order("t", str(package), str(folder / "out"), rubric.RUBRIC.read_text(), 0, fresh=True)
    with (
        dask_cluster(folder, 1, "--no-nanny") as (address, (worker,)),
        cluster.workforce(address, provenance.kit_hash(kits_own().folder)) as found,
    ):
        found.submit(order)
        # The grading's own process, and a sandbox that it has started.
        until(lambda: len(procfs.descendants(worker.pid)) > 3)
        assert left_by_gradings(folder)
        yield found, worker, set(procfs.descendants(worker.pid))


def left_by_gradings(folder: Path) -> list[str]:
    return [path.name for path in (folder / "tmp").iterdir() if path.name.startswith("batch-")]


@pytest.mark.sandbox
def test_a_killed_worker_left_the_submission_in_its_temporary_folder(tmp_path):
    with grading(tmp_path) as (_, worker, below):
        worker.kill()
        worker.wait()
        until(lambda: not any(map(procfs.runs, below)))
        until(lambda: not left_by_gradings(tmp_path))


@pytest.mark.sandbox
def test_ctrl_c_let_the_workers_grade_on_for_nobody(tmp_path):
    with grading(tmp_path) as (found, worker, _):
        found.stop()
        until(lambda: not procfs.descendants(worker.pid))
        until(lambda: not left_by_gradings(tmp_path))
