"""What the bench reads back is data: no byte of it stops the grader. The worker's files are made up here."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

from grader.student_tests import warm_worker

HERE = "/ws/package/ros2_robot_controller/a.py"


@pytest.mark.parametrize("line", ["²", "1" * 5000, "-1", "1e3", "", " 1", "٣"])
def test_a_line_that_is_no_number_is_left_out(line: str):
    text = json.dumps({"tests": ["t"], "reach": {HERE: {line: [0], "7": [0]}}})
    assert warm_worker._reach(text) == {"ros2_robot_controller/a.py": {7: frozenset({"t"})}}


@pytest.mark.parametrize(
    "text", ["[" * 100000, '{"status": ' + "9" * 5000 + "}", "[1]", '"x"', "", '{"status": NaN}', '{"status": 1e999}']
)
def test_whatever_the_worker_is_made_to_say_is_data(tmp_path: Path, text: str):
    for end in ("done", "report", "reach"):
        (tmp_path / f"0.{end}").write_text(text)
    ran = warm_worker._read_run(tmp_path, 0, 1.0)
    assert (ran.tests, ran.ended, ran.status, ran.reach) == ((), False, -1, {})


@pytest.mark.parametrize("entry", [{"queued": float("nan")}, {"queued": "x"}, {"queued": 10**400}, {"queued": [[]]}])
def test_numbers_that_are_none_count_as_none(tmp_path: Path, entry: dict[str, object]):
    (tmp_path / "0.done").write_text(json.dumps({"status": 0, **entry}))
    assert warm_worker._read_run(tmp_path, 0, 1.0).quiet_seconds == 1.0


def one(folder: Path) -> warm_worker.Bench:
    (folder / "out").mkdir()
    (folder / "data").mkdir()
    return warm_worker.Bench(None, folder / "requests", folder / "out", [0])  # type: ignore[arg-type]


def test_what_was_measured_is_copied_out_of_reach(tmp_path: Path):
    made = one(tmp_path)
    (made.out / "coverage.3.main").write_text("measured")
    (made.out / "link").hardlink_to(made.out / "coverage.3.main")
    kept = made._keep(3)
    (made.out / "link").write_text("forged")
    assert kept is not None
    assert kept.read_text() == "measured"


@pytest.mark.parametrize("put", [os.mkfifo, os.mkdir, lambda path: path.symlink_to("/etc/passwd"), lambda _path: None])
def test_what_is_no_plain_file_is_not_kept(tmp_path: Path, put):
    made = one(tmp_path)
    put(made.out / "coverage.3.main")
    assert made._keep(3) is None


def test_reading_the_source_while_importing_counts_for_all_tests():
    assert warm_worker._readers([{"reads": ""}], ["a", "b"]) == {"", "a", "b"}
    assert warm_worker._readers([{"reads": "a"}, {"start": "b"}], ["a", "b"]) == {"a"}
