"""Grading a class on a Dask cluster: no shared disk, the same results."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator

import pytest
from helpers.class_reports import Silent

from grader import KIT
from grader.classroom import batch, cluster
from grader.classroom.batch import Options
from grader.classroom.class_folder import ClassFolder, Status
from grader.errors import GraderError
from grader.host import provenance

pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("default")]  # a cluster of three processes


@pytest.fixture(scope="module")
def scheduler(tmp_path_factory) -> Iterator[str]:
    """Start a scheduler and two workers as their commands do, and return the scheduler's address."""
    folder = tmp_path_factory.mktemp("dask")
    file = folder / "scheduler.json"
    environment = os.environ | {"PYTHONPATH": str(KIT)}
    common = [sys.executable, "-m", "dask"]
    commands = [
        [*common, "scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--scheduler-file", str(file)],
        *(
            [
                *common,
                "worker",
                "--scheduler-file",
                str(file),
                "--nthreads",
                "1",
                "--no-dashboard",
                "--host",
                "127.0.0.1",
            ]
            for _ in range(2)
        ),
    ]
    started = [
        subprocess.Popen(command, cwd=folder, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        for command in commands
    ]
    try:
        deadline = time.monotonic() + 120
        while not file.exists() or not file.read_text().strip():
            assert time.monotonic() < deadline, "the scheduler did not start"
            time.sleep(0.1)  # nothing tells when a file appears
        address = json.loads(file.read_text())["address"]
        from distributed import Client

        with Client(address, timeout=60) as client:
            client.wait_for_workers(2, timeout=120)
        yield address
    finally:
        for process in reversed(started):
            process.terminate()
            process.wait(30)


@pytest.mark.sandbox
def test_submissions_travel_to_the_workers_and_results_come_back(scheduler, tmp_path):
    for name in ("team01", "team02", "team03"):
        (tmp_path / "source" / name).mkdir(parents=True)
        (tmp_path / "source" / name / "notes.txt").write_text("no package")
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
    nobody = cluster.workforce("tcp://127.0.0.1:9", provenance.kit_hash())
    with pytest.raises(GraderError, match=r"does not answer .* `dask scheduler`"), nobody:
        pass


def test_a_cluster_takes_as_many_submissions_as_it_has_threads(scheduler):
    with cluster.workforce(scheduler, provenance.kit_hash()) as found:
        assert found.slots == 2
