"""Grading a class: never stopped by one submission, resumed where it was interrupted."""

from __future__ import annotations

import os
import threading
from dataclasses import replace
from pathlib import Path

import pytest
from helpers.class_reports import GRADED, Silent

from grader.classroom import batch, class_folder
from grader.classroom.class_folder import ClassFolder, Status
from grader.classroom.cluster import pack, unzip
from grader.classroom.one_grading import Ending, Order, Runner
from grader.classroom.plan import Options
from grader.classroom.roster import Person
from grader.errors import GraderError, UsageError


def test_every_submission_gets_a_folder_and_a_record(tmp_path, source, workers):
    workers(lambda _order: GRADED)
    said = Silent()
    summary = batch.run(
        source, tmp_path / "class", [Person("s9", team="team09")], Options(seed=7, despite_doubts=True), said
    )
    assert (summary.entries, summary.graded, summary.missing) == (3, 3, 0), "team09's may be among them"
    folder = ClassFolder(tmp_path / "class")
    assert [entry.id for entry in folder.facts().entries] == ["team01", "team02", "team03"]
    assert folder.facts().seed == 7
    assert folder.report("team02") == {"total": 50}
    assert [record.id for record in said.records] == ["team01", "team02", "team03"]


def test_the_class_page_is_there_from_the_beginning_and_complete_in_the_end(tmp_path, source, workers):
    """After hours that were interrupted there was none."""
    pages, page = [], tmp_path / "class" / class_folder.OVERVIEW

    def refuse(order: Order) -> Ending:
        pages.append(page.read_text())
        if order.id == "team03":
            raise KeyboardInterrupt
        return Ending(Status.REFUSED, "is empty", 2.0)

    workers(refuse)
    batch.run(source, tmp_path / "class", [], Options(), Silent())
    assert (pages[0].count("is empty"), page.read_text().count("is empty")) == (0, 2)


def test_a_package_that_a_person_chose_is_graded_by_the_next_run_and_then_kept(tmp_path, source, workers):
    """Of several packages none is guessed; who refuses them says that overrides.yaml chooses."""
    graded: list[tuple[str, str]] = []

    def grade(order: Order) -> Ending:
        graded.append((order.id, order.package))
        return GRADED if order.id != "team01" or order.package else Ending(Status.REFUSED, "holds 2 packages", 2.0)

    workers(grade)
    for _ in range(3):
        batch.run(source, tmp_path / "class", [], Options(), Silent())
        (tmp_path / "class" / "overrides.yaml").write_text("submissions: {team01: {package: src/mine}}")
    assert graded == [("team01", ""), ("team02", ""), ("team03", ""), ("team01", "src/mine")]
    record = ClassFolder(tmp_path / "class").record("team01")
    assert record is not None
    assert (record.status, record.package) == (Status.GRADED, "src/mine")


def test_an_error_of_ours_is_tried_once_more_and_by_the_next_run(tmp_path, source, workers):
    first = workers(lambda order: Ending(Status.ERROR, "killed") if order.id == "team02" else GRADED)
    summary = batch.run(source, tmp_path / "class", [], Options(), Silent())
    assert first.orders == ["team01", "team02", "team03", "team02"]
    assert summary.errors == 1
    second = workers(lambda _order: GRADED)
    assert batch.run(source, tmp_path / "class", [], Options(), Silent()).graded == 3
    assert second.orders == ["team02"]


def test_ctrl_c_keeps_what_is_finished(tmp_path, source, workers):
    def how(order: Order) -> Ending:
        if order.id == "team03":
            raise KeyboardInterrupt
        return GRADED

    interrupted = workers(how)
    summary = batch.run(source, tmp_path / "class", [], Options(), Silent())
    assert summary.interrupted
    assert interrupted.stopped
    finished = {name for name in ("team01", "team02", "team03") if ClassFolder(tmp_path / "class").record(name)}
    rest = workers(lambda _order: GRADED)
    batch.run(source, tmp_path / "class", [], Options(), Silent())
    assert set(rest.orders) == {"team01", "team02", "team03"} - finished


def test_a_half_written_submission_is_no_result(tmp_path, source, workers):
    workers(lambda _order: GRADED)
    batch.run(source, tmp_path / "class", [], Options(), Silent())
    record = tmp_path / "class" / "submissions" / "team02" / class_folder.RECORD
    record.write_text(record.read_text()[:40])
    again = workers(lambda _order: GRADED)
    batch.run(source, tmp_path / "class", [], Options(), Silent())
    assert again.orders == ["team02"]


def test_two_runs_do_not_write_to_one_class(tmp_path, source):
    folder = ClassFolder(tmp_path / "class")
    with folder.locked(), pytest.raises(GraderError, match="being written by another run"):
        batch.run(source, tmp_path / "class", [], Options(), Silent())


def test_a_folder_that_cannot_be_written_is_a_sentence(tmp_path, source):
    (tmp_path / "file").touch()
    with pytest.raises(GraderError, match=r"cannot be written .* Choose another --out"):
        batch.run(source, tmp_path / "file" / "class", [], Options(), Silent())


@pytest.mark.sandbox
def test_a_submission_is_graded_in_a_process_of_its_own(tmp_path, source):
    """A folder without a package is refused there, which needs no build."""
    summary = batch.run(source, tmp_path / "class", [], Options(jobs=2), Silent())
    assert (summary.refused, summary.errors) == (3, 0)
    record = ClassFolder(tmp_path / "class").record("team01")
    assert record is not None
    assert "team01" in record.why


def order(tmp_path: Path, source: Path) -> Order:
    rubric = batch.rubric.RUBRIC.read_text()
    (tmp_path / "out").mkdir()
    return Order("team01", str(source), str(tmp_path / "out"), rubric, 0)


def test_a_stopped_runner_ends_what_is_going_on(tmp_path, source):
    started = threading.Event()
    runner = Runner(lambda _id, _what: started.set())
    endings: list[Ending] = []
    package = Path(batch.rubric.RUBRIC).parent / "solution_pkg" / "ros2_robot_controller"
    thread = threading.Thread(target=lambda: endings.append(runner.grade(order(tmp_path, package))))
    thread.start()
    assert started.wait(60), "it says what it is doing"
    runner.stop()
    thread.join(30)
    assert [ending.status for ending in endings] == [Status.ERROR]
    assert runner.grade(order(tmp_path / "source", package)).why == "interrupted"


def test_a_submission_that_takes_too_long_is_ended_and_costs_nobody_points(tmp_path, source):
    ending = Runner().grade(replace(order(tmp_path, source / "team01"), limit_s=0.006))
    assert ending.status is Status.ERROR
    assert ending.why == "It was not done after 0.0001 minutes (--minutes): look at it, or give it more."


def test_without_namespaces_no_more_gradings_run_at_a_time_than_can_be_kept_apart(tmp_path, source, monkeypatch):
    monkeypatch.setattr(batch.sandbox, "require", lambda: None)
    monkeypatch.setattr(batch.namespaces, "confinement", lambda: batch.namespaces.Confinement.USERS)
    with pytest.raises(UsageError, match="can keep 11 gradings apart, not 12"):
        batch.run(source, tmp_path / "class", [], Options(jobs=12), Silent())


def test_a_folder_travels_with_the_modes_of_its_files(tmp_path):
    """On a cluster the executables of a package that was handed in as a folder were none."""
    program = tmp_path / "package" / "scripts" / "run"
    program.parent.mkdir(parents=True)
    program.write_text("#!/bin/sh\n")
    program.chmod(0o755)
    os.utime(program, (0, 0))  # a zip has no times before 1980
    unzip(pack(tmp_path / "package"), tmp_path / "there")
    assert (tmp_path / "there" / "scripts" / "run").stat().st_mode & 0o777 == 0o755
