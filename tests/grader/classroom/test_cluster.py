"""Grading a class on a Dask cluster: no shared disk, the same results."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from helpers.class_reports import Silent
from helpers.dask_cluster import dask_cluster, wait_until

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


@pytest.fixture(scope="module")
def scheduler(tmp_path_factory) -> Iterator[str]:
    """Return the address of a scheduler with two workers."""
    with dask_cluster(tmp_path_factory.mktemp("dask"), 2) as (address, _):
        yield address


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
        wait_until("a sandbox is running", lambda: len(procfs.descendants(worker.pid)) > 3)
        assert left_by_gradings(folder)
        yield found, worker, set(procfs.descendants(worker.pid))


def left_by_gradings(folder: Path) -> list[str]:
    return [path.name for path in (folder / "tmp").iterdir() if path.name.startswith("batch-")]


def alive(pids: set[int]) -> list[str]:
    return [text for pid in pids if (text := command(pid))]


def command(pid: int) -> str:
    """Return a process's command, "" if it has ended."""
    try:
        return Path(f"/proc/{pid}/cmdline").read_bytes().replace(b"\0", b" ").decode()
    except OSError:
        return ""


@pytest.mark.sandbox
def test_a_killed_worker_left_the_submission_in_its_temporary_folder(tmp_path):
    with grading(tmp_path) as (_, worker, below):
        worker.kill()
        worker.wait()
        wait_until("all processes have ended", lambda: not alive(below))
        wait_until("all temporary files are removed", lambda: not left_by_gradings(tmp_path))


@pytest.mark.sandbox
def test_ctrl_c_let_the_workers_grade_on_for_nobody(tmp_path):
    with grading(tmp_path) as (found, worker, _):
        found.stop()
        wait_until("the grading has ended", lambda: not procfs.descendants(worker.pid))
        wait_until("all temporary files are removed", lambda: not left_by_gradings(tmp_path))
