"""A course with `extends: kit`: it keeps the kit's own, and changes points, words, files and requirements."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
import yaml
from helpers.course import COURSE, REFERENCE

from grader import KIT, cli
from grader.authoring import check_course, new_requirement
from grader.authoring.release import TOP
from grader.classroom.class_folder import RUBRIC, ClassFolder
from grader.course import Course, load
from grader.course.reader import VARIABLE
from grader.errors import GraderError
from grader.host import provenance
from grader.notebook import checking
from grader.notebook.workspace import Workspace
from grader.scoring import rubric
from grader.trials import catalog

KITS = rubric.load(COURSE.rubric)
KITS_TEXT = COURSE.rubric.read_text()


@pytest.fixture
def course(tmp_path: Path) -> Course:
    assert cli.main(["new-course", str(tmp_path / "ours"), "--extends", "kit"]) == 0
    return load(tmp_path / "ours")


def change(course: Course, old: str, new: str) -> None:
    text = course.rubric.read_text()
    assert text.count(old) == 1
    course.rubric.write_text(text.replace(old, new))


# -- what it is --------------------------------------------------------------------------------------------------------


def test_it_has_what_it_changes_and_otherwise_what_the_kit_has(course: Course):
    whole = check_course.read_rubric(course)
    assert (whole.requirement("F4").points, KITS.requirement("F4").points) == (6, 5)
    assert whole.requirement("F1").title == "Stands still until it is sent"
    assert whole.requirement("F1").text == KITS.requirement("F1").text
    ids = [requirement.id for requirement in whole.requirements]
    kits = [requirement.id for requirement in KITS.requirements]
    assert ids == [*kits[: kits.index("Q1")], "X1", *(name for name in kits[kits.index("Q1") :] if name != "Q6")]
    assert [criterion.points for criterion in whole.criteria] == [43, 22, 20, 15]
    same = [name for name in ids if name not in ("F1", "F4", "X1")]
    assert [whole.requirement(name) for name in same] == [KITS.requirement(name) for name in same]
    assert (course.nodes, course.package, course.solution) == (COURSE.nodes, COURSE.package, COURSE.solution)
    assert set(catalog.trials(course)) == {*catalog.trials(COURSE), "into_the_dead_end"}
    assert check_course.mistakes(course.folder) == []


def test_a_file_takes_the_place_of_the_kits_with_the_same_name(course: Course):
    (course.folder / "trials" / "speed.py").write_text(
        "from grader.trials.catalog import trial\n\n\n"
        '@trial(serves=["F2", "F3", "F11"])\ndef drive_forward(stage):\n    """Drive."""\n'
    )
    (course.folder / "checks" / "check_idle.py").write_text('def test_is_ours(judge):\n    """It is."""\n')
    found = catalog.trials(course)
    assert found["drive_forward"].serves == ("F2", "F3", "F11")
    assert "drive_backward" not in found
    assert "wall_fast" in found
    lacking = "check_idle::test_publishes_zero_without_a_command"
    line = KITS_TEXT[: KITS_TEXT.index(lacking)].count("\n") + 1
    mistakes = "\n".join(check_course.mistakes(course.folder))
    assert f"{COURSE.rubric}, line {line}: {lacking} is not a check of the kit." in mistakes


def test_another_world_of_its_own_counts(course: Course):
    assert course.world("wall_ahead") == "wall_ahead"
    shutil.copy(course.world("dead_end"), course.folder / "worlds" / "wall_ahead.yaml")
    assert course.world("wall_ahead") == str(course.folder / "worlds" / "wall_ahead.yaml")


def test_a_trial_with_the_name_of_one_of_the_kits_in_another_file_is_refused(course: Course):
    trials = course.folder / "trials" / "dead_end.py"
    trials.write_text(trials.read_text().replace("into_the_dead_end", "drive_forward"))
    assert "the trial drive_forward: another trial has this name" in "\n".join(check_course.mistakes(course.folder))


def test_what_either_folder_has_decides_a_grade(course: Course):
    before = provenance.kit_hash(course.layers), provenance.checks_hash(course.layers)
    assert before[0] != provenance.kit_hash([course.folder])
    (course.folder / "checks" / "more.py").write_text("LIMIT = 1\n")
    assert provenance.kit_hash(course.layers) != before[0]
    assert provenance.checks_hash(course.layers) != before[1]
    before = provenance.kit_hash(course.layers), provenance.checks_hash(course.layers)
    (course.folder / "hunts").mkdir()
    (course.folder / "hunts" / "more.py").write_text("LIMIT = 1\n")
    assert provenance.kit_hash(course.layers) != before[0]  # the evidence, not what is made of it
    assert provenance.checks_hash(course.layers) == before[1]


def test_the_kits_rubric_and_the_changes_both_decide_its_hash(course: Course, monkeypatch: pytest.MonkeyPatch):
    """A class is judged by the whole; the file of the changes alone stays the same when the kit's rubric is changed."""
    before = rubric.load(course.rubric).sha256
    other = course.folder / "kits.yaml"
    other.write_text(KITS_TEXT.replace("title: Refuses a bad speed", "title: Refuses what is too fast"))
    monkeypatch.setattr(rubric, "RUBRIC", other)
    assert rubric.load(course.rubric).sha256 != before


@pytest.mark.parametrize(
    ("old", "new", "line", "said"),
    [
        ("id: F4", "id: F41", "id: F41", "F41 is not in the kit's rubric, and a new one needs text and checks. Did you mean F4?"),
        ("id: functionality", "id: functionalities", "id: functionalities", "functionalities is not in the kit's rubric, and a new one needs title and levels and requirements. Did you mean functionality?"),
        ("never_touches_the_obstacle", "never_touches_an_obstacle", "never_touches_an", "check_obstacle::test_never_touches_an_obstacle is not a check of the kit. Did you mean check_obstacle::test_never_touches_the_obstacle?"),
        ("id: F4", "id: I4", "id: I4", "the kit's rubric has I4 in ros2_integration; write it there"),
        ("id: F4", "id: X1\n      - id: F4", "id: X1\n      - id: F4", "X1 is not in the kit's rubric, and a new one needs text and checks."),
        ("id: F1\n", "id: F4\n", "id: F4\n        title", "F4 is written twice; join the two"),
        ("title: Stands", "titel: Stands", "titel:", "titel is not allowed here. Did you mean title?"),
        ("[Q6]", "[Q66]", "[Q66]", "Q66 is not in the kit's rubric. Did you mean Q6?"),
        ("[Q6]", '["check_functions::test_functions_are_right_at_their_edges"]', "dropped", "nothing is left of F14; drop it as a whole"),
        ("points: 2}", "points: 2}\n        points: 3", "points: 3\n", "X1 has 3 points, its checks 2"),
        ("title: Stands still until it is sent", "held_back: true", "id: F1\n", "students have the trials and checks of F1; hold back a requirement of your own"),
        ("extends: kit", "extends: kitt", "extends", "kitt is not a rubric that can be extended. Did you mean kit?"),
    ],
)  # fmt: skip
def test_a_mistake_in_the_changes_is_named_with_its_place(course: Course, old: str, new: str, line: str, said: str):
    change(course, old, new)
    text = course.rubric.read_text()
    number = text[: text.index(line)].count("\n") + 1
    found = check_course.mistakes(course.folder)
    assert any(f"line {number}: {said}" in each and "rubric.yaml" in each for each in found), found


def test_a_course_extends_no_other_than_the_kits(tmp_path: Path):
    (tmp_path / "course.yaml").write_text("extends: kits\nrubric: rubric.yaml\n")
    (said,) = check_course.mistakes(tmp_path)
    assert said.startswith("course.yaml, line 1: kits is not a course that can be extended. Did you mean kit?")


def test_a_check_that_was_dropped_can_be_in_another_requirement(course: Course):
    change(course, "[Q6]", '[Q6, "check_idle::test_publishes_at_the_control_rate"]')
    change(
        course,
        "points: 2}",
        'points: 2}\n          - {id: "check_idle::test_publishes_at_the_control_rate", points: 1}',
    )
    whole = rubric.load(course.rubric)
    assert [check.id for check in whole.requirement("F1").checks] == [
        "check_idle::test_publishes_zero_without_a_command"
    ]
    assert (whole.requirement("F1").points, whole.requirement("X1").points) == (1.5, 3)


def test_a_new_requirement_goes_into_the_changes(course: Course):
    new_requirement.add(course, "X2")
    assert check_course.mistakes(course.folder) == []
    assert [r.id for r in check_course.read_rubric(course).criteria[0].requirements][-2:] == ["X1", "X2"]
    assert "extends: kit" in course.rubric.read_text()


def test_a_new_requirement_cannot_have_the_name_of_a_trial_of_the_kit(course: Course):
    with pytest.raises(GraderError, match="wall_fast"):
        new_requirement.add(course, "wall_fast")


# -- what it does ------------------------------------------------------------------------------------------------------


def test_a_notebook_that_checks_what_is_dropped_says_so(
    course: Course, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    """`check("Q6")` ended the run of notebook 10 with ValueError."""
    monkeypatch.setenv(VARIABLE, str(course.folder))
    found = checking.check(Workspace(tmp_path / "ws"), ["Q6"])
    assert repr(found) == "Q6 is not graded in this course."
    assert found.passed


def test_its_lessons_and_those_of_the_kit_are_imported_beside_the_functions_of_every_notebook(course: Course):
    (course.folder / "lessons").mkdir()
    (course.folder / "lessons" / "hints.py").write_text("WORDS = 'mind the dead end'\n")
    script = (
        "from grader.notebook import hints; from grader.notebook.sliders import step; print(hints.WORDS, step(0, 1, 0))"
    )
    said = subprocess.run(
        [sys.executable, "-c", script],
        cwd=KIT, env=os.environ | {VARIABLE: str(course.folder)}, capture_output=True, text=True, check=True,
    ).stdout  # fmt: skip
    assert said == "mind the dead end 0.02\n"


def test_a_stand_in_that_is_dropped_is_not_asked_for(course: Course, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """In notebook 04 `check("F6")` asks F12."""
    change(course, "[Q6]", "[Q6, F12]")
    monkeypatch.setenv(VARIABLE, str(course.folder))
    monkeypatch.setenv(checking.NOTEBOOK, "04")
    (answer,) = checking.check(Workspace(tmp_path / "ws"), ["F6"]).answers
    assert answer.id == "F6"


@pytest.mark.slow  # a kit is released
def test_the_students_kit_is_the_kits_own_with_the_changes_in_it(
    course: Course, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setenv(VARIABLE, "")  # `release` sets it
    new_requirement.add(course, "X2")
    change(course, "- id: X2\n", "- id: X2\n        held_back: true\n")
    for name in ("trials/x2.py", "checks/check_x2.py"):
        (course.folder / "held_back" / name).parent.mkdir(parents=True)
        (course.folder / name).rename(course.folder / "held_back" / name)
    assert cli.main(["release", "--course", str(course.folder), "--out", str(tmp_path / "kit.zip")]) == 0
    with zipfile.ZipFile(tmp_path / "kit.zip") as opened:
        opened.extractall(tmp_path)
    kit = tmp_path / TOP
    names = {path.relative_to(kit).as_posix() for path in kit.rglob("*") if path.is_file()}
    home = COURSE.folder.relative_to(KIT).as_posix()
    assert {f"{home}/{n}" for n in ("trials/dead_end.py", "trials/speed.py", "worlds/dead_end.yaml")} <= names
    assert not [n for n in names if "x2" in n or "known_bad" in n or n.startswith(f"{home}/rubric")]
    assert "drives no faster than 0.35 m/s" in (kit / "docs" / "handout.md").read_text()
    data = yaml.safe_load((kit / "rubric.yaml").read_text())
    assert "extends" not in data
    script = (
        "import json; from grader.course import kits_own; from grader.notebook import checking\n"
        "from grader.scoring import rubric; course = kits_own(); whole = rubric.load(course.rubric)\n"
        "x2 = whole.requirement('X2')\n"
        "points = [criterion.points for criterion in whole.criteria]\n"
        "print(json.dumps([course.title, str(course.folder), whole.dropped, x2.waits, points]))"
    )
    said = subprocess.run([sys.executable, "-c", script], cwd=kit, capture_output=True, text=True, check=True).stdout
    assert json.loads(said) == [
        "ROS 2 package development, with a requirement of our own", str(kit / home), ["Q6"], "judged at hand-in",
        [44, 22, 20, 15],
    ]  # fmt: skip


@pytest.mark.ros
@pytest.mark.sandbox
@pytest.mark.slow  # the kit's solution is graded twice, and a known-bad edit of it
def test_the_solution_and_the_edit_get_the_points_that_they_should(course: Course, capsys: pytest.CaptureFixture[str]):
    capsys.readouterr()
    assert cli.main(["check-course", str(course.folder)]) == 0
    assert capsys.readouterr().out == f"{course.folder}: nothing is wrong\n"


@pytest.mark.ros
@pytest.mark.sandbox
@pytest.mark.slow  # a whole grading
def test_a_class_is_graded_by_the_whole_and_judged_again_by_changes(course: Course, tmp_path: Path):
    handed_in = tmp_path / "handed_in" / "team01"
    shutil.copytree(REFERENCE, handed_in / REFERENCE.name, ignore=shutil.ignore_patterns("__pycache__"))
    out = tmp_path / "class"
    assert cli.main(["batch", str(handed_in.parent), "--course", str(course.folder), "--out", str(out)]) == 0
    folder = ClassFolder(out)
    report = folder.report("team01") or {}
    assert {r["id"]: r["points"] for r in report["requirements"] if r["id"] in ("F4", "Q6", "X1")} == {"F4": 6, "X1": 2}
    assert report["total"] == report["max"] == 100
    kept = (out / RUBRIC).read_text()
    assert "extends" not in yaml.safe_load(kept)
    assert rubric.load(out / RUBRIC).sha256 == folder.facts().rubric
    assert cli.main(["batch", "--out", str(out)]) == 0  # nothing to do
    change(course, "points: 3.5}", "points: 7.5}")
    assert cli.main(["rescore", str(out), "--rubric", str(course.rubric)]) == 0
    report = folder.report("team01") or {}
    assert report["total"] == report["max"] == 104
