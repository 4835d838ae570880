"""What is kept of the files that a run leaves behind, and nothing of a run that is stopped for its time."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path
from types import SimpleNamespace

import pytest

from grader.student_tests import warm_worker
from grader.student_tests.worker import watch


def worker(folder: Path) -> warm_worker.WarmWorker:
    (folder / "out").mkdir()
    (folder / "data").mkdir()
    return warm_worker.WarmWorker(None, None, folder / "requests", folder / "out", [0])  # type: ignore[arg-type]


def test_coverage_data_is_copied_out_of_reach(tmp_path: Path):
    made = worker(tmp_path)
    (made.out / "coverage.3.main").write_text("measured")
    (made.out / "link").hardlink_to(made.out / "coverage.3.main")
    kept = made._keep_coverage(3)
    (made.out / "link").write_text("forged")
    assert kept is not None
    assert kept.read_text() == "measured"


@pytest.mark.parametrize("put", [os.mkfifo, os.mkdir, lambda path: path.symlink_to("/etc/passwd"), lambda _path: None])
def test_coverage_data_that_is_not_a_regular_file_is_not_kept(tmp_path: Path, put):
    made = worker(tmp_path)
    put(made.out / "coverage.3.main")
    assert made._keep_coverage(3) is None


def test_a_run_that_is_stopped_for_its_time_leaves_no_descriptor_open(tmp_path: Path):
    before = len(list(Path("/proc/self/fd").iterdir()))
    with subprocess.Popen(["sleep", "1000"]) as hangs:
        end = watch(hangs.pid, tmp_path / "report", {"limits": {}, "limit": 1.0, "total": 0.0})
    assert end["late"] == "collection"
    assert len(list(Path("/proc/self/fd").iterdir())) == before


def test_a_worker_that_has_ended_is_replaced(tmp_path: Path):
    """The dead worker was given every later run, and each mutant in them counted as unnoticed."""
    made: list[SimpleNamespace] = []

    def start(number: int, domain_id: int) -> SimpleNamespace:
        made.append(SimpleNamespace(alive=True, run=lambda _request: end(number), domain_id=domain_id or 7))
        return made[-1]

    def end(number: int) -> int:
        made[number].alive = False
        return number

    workers = warm_worker.WorkerPool(start, tmp_path, 1)  # type: ignore[arg-type]
    assert [workers.run(warm_worker.ModuleRequest("test_it.py")) for _ in range(3)] == [0, 1, 2]
