"""Grade real packages on a real graph: the reference, and the reference with one thing wrong."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import zipfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import pytest
from conftest import lost, words
from submissions.edits import EDITS, apply

pytestmark = [pytest.mark.ros, pytest.mark.sandbox]

# What the first cut judges by trials; the package's own tests notice most faults too, which is T's own matter.
BY_TRIAL = ("F1", "F2", "F3", "F4", "F7", "F8", "I1", "I3", "I4")

Grade = Callable[[str, Sequence[str]], dict[str, Any]]


def grader(*arguments: object, **options: Any) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "grader.cli", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=600, **options)


def test_the_reference_loses_nothing(graded: Grade):
    report = graded("", BY_TRIAL)
    assert lost(report) == set(), words(report)
    assert report["complete"]
    assert report["total"] == report["max"] > 0


@pytest.mark.parametrize("name", sorted(EDITS))
def test_a_fault_costs_its_own_points_and_no_others(graded: Grade, name: str):
    report = graded(name, BY_TRIAL)
    assert report["complete"], words(report)
    assert lost(report) == EDITS[name].costs, words(report)
    for said in EDITS[name].says:
        assert said in words(report)


def test_what_cannot_be_reached_says_because_of_what(graded: Grade):
    report = graded("does_not_compile", BY_TRIAL)
    outcomes = {r["id"]: r["outcome"] for r in report["requirements"]}
    assert outcomes["I1"] == "failed"
    assert outcomes["F1"] == "not_reached"
    assert "colcon build" in json.dumps([r for r in report["requirements"] if r["id"] == "F1"])


def test_a_dead_controller_leaves_the_processor_its_points(graded: Grade):
    """Each node is judged on its own."""
    report = graded("crashes_at_start", BY_TRIAL)
    points = {r["id"]: r["points"] for r in report["requirements"]}
    assert points["I1"] == 3
    assert points["I4"] > 0


def test_a_second_grading_builds_nothing_and_says_the_same(reference: Path, tmp_path: Path):
    """By the command, as an instructor grades: console, report.json, report.html, evidence."""
    first = grader("grade", reference, "--out", tmp_path / "a")
    second = grader("grade", reference, "--out", tmp_path / "b")
    assert first.returncode == second.returncode == 0, first.stderr + second.stderr
    assert second.stdout.strip().endswith(f"Report: {tmp_path / 'b' / 'report.html'}")
    one, two = (json.loads((tmp_path / name / "report.json").read_text()) for name in "ab")
    assert one["requirements"] == two["requirements"]
    assert one["total"] == one["max"], words(one)
    assert json.loads((tmp_path / "b" / "evidence" / "build.json").read_text())["cached"] is True
    assert (tmp_path / "b" / "evidence" / "trials" / "idle.json").is_file()
    assert "<img" in (tmp_path / "b" / "report.html").read_text()


def test_a_zip_with_one_folder_too_many_is_graded(reference: Path, tmp_path: Path, settings):
    archive = tmp_path / "team07.zip"
    with zipfile.ZipFile(archive, "w") as stream:
        for path in reference.rglob("*"):
            if path.is_file() and "__pycache__" not in path.parts:
                stream.write(path, Path("team07 (1)") / reference.name / path.relative_to(reference))
    from grader import pipeline

    grading = pipeline.grade(archive, tmp_path / "out", pipeline.replace(settings, requirements=("I1", "F1")))
    assert grading.submission == "team07.zip"
    assert grading.scorecard.points == grading.scorecard.max == 6


def test_an_empty_folder_is_no_submission(tmp_path: Path):
    (tmp_path / "empty").mkdir()
    done = grader("grade", tmp_path / "empty", "--out", tmp_path / "out")
    assert done.returncode == 1
    assert "empty is empty" in done.stderr
    assert "Traceback" not in done.stderr


def test_a_readme_alone_is_no_submission(tmp_path: Path):
    (tmp_path / "only").mkdir()
    (tmp_path / "only" / "README.md").write_text("# My robot\n")
    done = grader("grade", tmp_path / "only", "--out", tmp_path / "out")
    assert done.returncode == 1
    assert "package.xml" in done.stderr


def test_a_submission_that_is_not_there_is_said_so(tmp_path: Path):
    done = grader("grade", tmp_path / "nobody.zip", "--out", tmp_path / "out")
    assert done.returncode == 1
    assert "nobody.zip" in done.stderr


def test_wrong_usage_is_status_2():
    assert grader("grade").returncode == 2
    assert grader("frobnicate").returncode == 2


def test_a_package_xml_that_is_no_xml_is_told_in_words(tmp_path: Path, settings):
    from grader import pipeline

    package = apply(None, tmp_path)
    (package / "package.xml").write_text("this is <not xml")
    grading = pipeline.grade(package, tmp_path / "out", pipeline.replace(settings, requirements=("F1", "I1")))
    assert grading.scorecard.points == 0
    assert grading.scorecard.complete


def test_a_build_that_hangs_is_stopped_and_told(tmp_path: Path):
    package = apply(None, tmp_path)
    cmake = package / "CMakeLists.txt"
    hang = "execute_process(COMMAND sleep 1000)\nfind_package(ament_cmake"
    cmake.write_text(cmake.read_text().replace("find_package(ament_cmake", hang))
    done = grader("grade", package, "--out", tmp_path / "out", "--build-timeout", "3")
    assert done.returncode == 0, done.stderr
    assert "ran out of time" in done.stdout
    assert "Traceback" not in done.stdout + done.stderr


def test_a_rubric_that_cannot_be_read_is_our_fault(reference: Path, tmp_path: Path):
    (tmp_path / "rubric.yaml").write_text("- nothing\n")
    done = grader("grade", reference, "--out", tmp_path / "out", "--rubric", tmp_path / "rubric.yaml")
    assert done.returncode == 3
    assert "rubric" in done.stderr


def test_a_host_without_walls_refuses_to_grade(reference: Path, tmp_path: Path):
    bare = tmp_path / "bin"
    bare.mkdir()
    for tool in ("sh", "true"):
        (bare / tool).symlink_to(shutil.which(tool) or "")
    done = grader("grade", reference, "--out", tmp_path / "out", env={"PATH": str(bare)})
    assert done.returncode == 3
    assert "grader doctor" in done.stderr
