"""A class on a Dask scheduler whose workers are in containers, one of which has no namespaces."""

from __future__ import annotations

import re
import subprocess
import uuid
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path

import pytest
import yaml
from helpers.class_reports import Silent
from helpers.dask_cluster import dask_cluster, wait_for_workers
from submissions import edits

from containers import situations
from containers.situations import DOCKER, PYTHON, UNCONFINED, command_line
from grader.classroom import batch, gradebook, overview
from grader.classroom.class_folder import ClassFolder
from grader.classroom.plan import Options
from grader.scoring import rubric

pytestmark = [
    pytest.mark.containers,
    pytest.mark.slow,  # gradings in containers
    pytest.mark.filterwarnings("default"),
    pytest.mark.skipif(bool(situations.missing()), reason=f"missing: {situations.missing()}"),
]


@contextmanager
def worker(address: str, options: list[str], cache: Path, log: Path) -> Iterator[None]:
    """Run a Dask worker in a container on this machine's network, with a copy of the cache of its own."""
    name = f"worker-{uuid.uuid4().hex}"
    line = f"exec {PYTHON} -m dask worker {address} --nthreads 1 --no-dashboard --host 127.0.0.1"
    own = [f"--name={name}", "--env=HOME=/tmp", f"--env=ROS2_COURSE_KIT_CACHE={cache}"]
    with log.open("w") as file:
        run = subprocess.Popen(command_line([*options, *own], line, "host"), stdout=file, stderr=file)
        try:
            yield
        finally:
            subprocess.run(["podman", "rm", "--force", "--time=20", name], capture_output=True, check=False)
            run.wait(60)


def test_a_class_says_which_sandbox_graded_each_on_workers_in_containers(tmp_path: Path):
    """Two good packages, a slow one and one that does not build, on two requirements of 3 and 4 points."""
    asked = yaml.safe_load(rubric.RUBRIC.read_text())
    asked["criteria"] = asked["criteria"][:1]
    asked["criteria"][0]["points"] = 7
    asked["criteria"][0]["requirements"] = asked["criteria"][0]["requirements"][:2]
    (tmp_path / "rubric.yaml").write_text(yaml.safe_dump(asked))
    expected = {"team01": (None, 7.0), "team02": (None, 7.0), "team03": ("drives_too_slowly", 4.0)}
    expected["team04"] = ("does_not_compile", 0.0)
    for name, (edit, _) in expected.items():
        edits.apply(edits.EDITS[edit] if edit else None, tmp_path / "source" / name)
    cache = situations.prepared_cache(tmp_path)
    (tmp_path / "dask").mkdir()
    options = Options(rubric=tmp_path / "rubric.yaml")
    with ExitStack() as stack:
        address, _ = stack.enter_context(dask_cluster(tmp_path / "dask", 0))
        for number, confined in enumerate((UNCONFINED, DOCKER)):
            stack.enter_context(worker(address, confined, cache, tmp_path / f"worker{number}.log"))
        wait_for_workers(address, 2)
        summary = batch.run(tmp_path / "source", tmp_path / "class", [], replace(options, scheduler=address), Silent())
    assert (summary.graded, summary.errors) == (4, 0)
    folder = ClassFolder(tmp_path / "class")
    book = gradebook.read(folder)
    assert {row.submission: float(row.total or 0) for row in book.rows} == {
        name: points for name, (_, points) in expected.items()
    }
    graded_by = {row.submission: row.confinement for row in book.rows}
    assert set(graded_by.values()) == {"namespaces", "users"}
    page = overview.write(folder, book).read_text()
    assert page.count("confinement: users") == list(graded_by.values()).count("users")
    listed = re.search(r"Graded without namespaces</strong>.*", page)
    assert listed is not None
    for name, confinement in graded_by.items():
        assert (f"submissions/{name}/report.html" in listed[0]) == (confinement == "users")
        report = (folder.submission(name) / "report.html").read_text()
        assert ("Graded without namespaces" in report) == (confinement == "users")
