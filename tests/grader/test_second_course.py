"""A course of another package, with one node, one service and none of what else the kit's own course has.

grader/authoring/template_course holds it. It takes the trips of notebook, release and self-test here;
test_check_course.py grades its solution and its known-bad edits, and test_own_course_page.py a class.
"""

from __future__ import annotations

import json
import subprocess
import sys
import zipfile
import zlib
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from grader import KIT, building, cli, pipeline
from grader.authoring import checkpoint_texts, course_command, notebook_run, notebook_source
from grader.checks import checks_run
from grader.course import find, handout, kits_own, load, reader
from grader.course.reader import VARIABLE
from grader.scoring import rubric
from grader.trials import catalog
from grader.trials.source import wanted

HALL = KIT / "grader" / "authoring" / "template_course"
COURSE = load(HALL)
RUBRIC = rubric.load(COURSE.rubric, checks_run.known(COURSE))


@pytest.fixture(scope="module")
def settings() -> pipeline.Settings:
    return pipeline.Settings(RUBRIC, building.cache_folder(), COURSE)


# -- what it has, and what it has not ----------------------------------------------------------------------------------


def test_it_gets_the_stock_trials_for_what_its_contract_has():
    assert {name for name, plan in catalog.trials(COURSE).items() if plan.kind} == {
        "idle_guard", "standing_clock_guard", "interrupted_guard", "file_guard", "senseless_settings_guard",
        "senseless_start_guard",
    }  # fmt: skip


def test_a_stock_trial_runs_where_the_rubric_names_a_check_that_needs_it(settings: pipeline.Settings):
    """`serves` was a list of requirements' ids in each trial."""
    clock = replace(settings, requirements=("P4",))
    assert set(wanted(clock)) == {"standing_clock_guard"}
    assert set(wanted(replace(settings, requirements=("B3",)))) == {"to_the_end"}


def test_what_it_lacks_is_absent_from_its_handout():
    page = handout.render(RUBRIC, COURSE)
    assert "| `guard` | service `patrol` | `std_srvs/srv/SetBool` |" in page
    assert "| `guard` | `patrol_speed` | 0.25 | m/s |" in page
    page = page.replace("_interfaces`", "")  # packages of ROS
    assert not any(word in page for word in ("launch", "action", "interface", kits_own().package))


def test_its_course_is_the_one_that_is_named(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.delenv(VARIABLE, raising=False)
    monkeypatch.chdir(HALL / "notebooks")
    assert find() is kits_own()
    assert find(Path("..")) is COURSE
    monkeypatch.setenv(VARIABLE, "..")
    assert find() is COURSE


# -- notebook, release, self-test --------------------------------------------------------------------------------------


@pytest.mark.ros
@pytest.mark.sandbox
@pytest.mark.slow  # builds and starts its node
def test_its_notebook_passes_its_checks(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    monkeypatch.setenv(VARIABLE, str(HALL))
    notebook = notebook_source.read("01_guard", RUBRIC, COURSE.notebooks)
    solved = notebook_run.solved("01_guard", notebook, checkpoint_texts.solution)
    run = notebook_run.solve("01_guard", solved, tmp_path / "ws")
    assert run.error is None
    assert any(
        "on patrol" in notebook_run.plain_text(o) for cell in run.notebook.cells for o in cell.get("outputs", [])
    )


def test_its_kit_has_its_notebook_and_nothing_of_the_other_course(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    monkeypatch.setenv(VARIABLE, "")  # set by the verb, and put back here
    assert cli.main(["release", "--course", str(HALL), "--out", str(tmp_path / "kit.zip")]) == 0
    with zipfile.ZipFile(tmp_path / "kit.zip") as kit:
        kit.extractall(tmp_path)
    top = tmp_path / "ros2-course-kit"
    assert (top / HALL.name / "notebooks" / "01_guard.ipynb").is_file()
    assert not any((top / HALL.name / name).exists() for name in ("solution", "known_bad", "notebooks/source"))
    assert not (top / "grader" / "courses").exists()
    script = (
        "from grader.course import find, passed_over; print(find().package, find().notebooks.is_dir(), passed_over())"
    )
    said = subprocess.run(
        [sys.executable, "-c", script], cwd=top / HALL.name / "notebooks", env={"PYTHONPATH": str(top)},
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert said.stdout.split() == ["hall_guard", "True"]


def test_a_kit_has_the_solved_files_of_the_notebooks_before_the_last_one_and_no_others(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
):
    """The page said that the solution stays with the lecturer, and all of it was packed."""
    monkeypatch.setenv(VARIABLE, "")
    folder = course_command.lay_out(tmp_path / "mine").folder
    guard, settings = (
        folder / "solution" / "hall_guard" / name for name in ("hall_guard/guard.py", "config/guard.yaml")
    )
    assert released(folder, tmp_path / "one.zip") == {}
    table = folder / "notebooks.yaml"
    table.write_text(
        "notebooks:\n  01_guard: {exercises: [config/guard.yaml]}\n  02_more: {exercises: [hall_guard/guard.py]}\n"
    )
    reader.loaded.cache_clear()
    packed = released(folder, tmp_path / "two.zip")
    assert packed == {"01": {"config/guard.yaml": settings.read_text()}}
    assert guard.read_text() not in str(packed)


def released(folder: Path, archive: Path) -> dict[str, Any]:
    """Return the texts that are packed in a kit; no other file of it has a text that a student is to write."""
    assert cli.main(["release", "--course", str(folder), "--out", str(archive)]) == 0
    answer = (folder / "solution" / "hall_guard" / "hall_guard" / "guard.py").read_text()
    with zipfile.ZipFile(archive) as kit:
        assert not [name for name in kit.namelist() if answer.encode() in kit.read(name)]
        found = [name for name in kit.namelist() if name.endswith("checkpoints.bin")]
        return json.loads(zlib.decompress(kit.read(found[0]))) if found else {}


@pytest.mark.ros
@pytest.mark.sandbox
@pytest.mark.slow  # five gradings
def test_attacks_on_it_are_contained(capsys: pytest.CaptureFixture[str]):
    names = ["writes_the_results", "overwrites_the_grader", "runs_code_at_build", "builds_as_root", "calls_home"]
    assert cli.main(["self-test", "--course", str(HALL), "--only", *names]) == 0
    assert "5 of 5 attacks were contained" in capsys.readouterr().out
