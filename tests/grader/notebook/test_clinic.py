"""The clinic: each patient is ill, its diagnosis is accepted where the fault is, and its cure cures it."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest
from helpers.course import PACKAGE
from helpers.notebook_fixtures import as_in_a_kernel

from grader.authoring import checkpoint_texts
from grader.courses.robot_controller.lessons import clinic
from grader.courses.robot_controller.patients import patients
from grader.intake.package_edits import replace
from grader.notebook import checkpoints, pieces
from grader.notebook.cell_hooks import forget_changed_modules
from grader.notebook.workspace import NOTEBOOK, Workspace, find

CASES = [case for case in patients.cases() if not case.startswith(patients.HUNTED)]


@pytest.fixture
def ward(workspace: Workspace) -> Iterator[Workspace]:
    """A workspace in which patients can be admitted, and imported as in a kernel."""
    os.environ[NOTEBOOK] = "11"
    with as_in_a_kernel(Workspace(workspace.root / clinic.FOLDER)):
        yield workspace


def diagnosis(case: str) -> str:
    return patients.answer(f"diagnosis = ''  # {case}").split('"')[1]


def cure(case: str) -> None:
    """Do what the published cell does, with the hooks around it."""
    forget_changed_modules(find().package)
    cell = patients.answer(f"# {case}")
    if cell.startswith("!"):
        subprocess.run(cell[1:], shell=True, check=True, capture_output=True)
    else:
        first, _, body = cell.partition("\n")
        pieces.into(first.split()[1], body + "\n")
    forget_changed_modules(find().package)


def test_every_case_has_its_edits_and_its_signs():
    assert list(clinic.SIGNS) == CASES


def test_no_cure_stands_in_what_is_released_in_plain_sight():
    """The patients' edits show the solution's text."""
    shipped = Path(clinic.__file__).parent.glob("*")
    text = "".join(path.read_text() for path in shipped if path.is_file())
    for row in patients.cases().values():
        for edits in (*row.get("source", {}).values(), *row.get("installed", {}).values()):
            assert not any(edit["old"].strip() in text for edit in edits)


@pytest.mark.parametrize(
    ("said", "accepted"),
    [
        ("driver.py:9", True),
        ("ros2_robot_controller/driver.py:10", True),
        ("driver.py:11", False),
        ("iver.py:9", False),
        ("navigator.py:9", False),
        ("driver.py", False),
        ("", False),
        ("install/x/lib/python3/site-packages/ros2_robot_controller/driver.py:9", True),  # as in a traceback
    ],
)
def test_a_diagnosis_names_a_line_of_the_fault(said: str, accepted: bool):
    assert (not clinic._judge(said, [("ros2_robot_controller/driver.py", 9, 10)])) == accepted


def test_a_stale_install_is_diagnosed_in_the_installed_file_alone():
    where = [("site-packages/ros2_robot_controller/driver.py", 29, 29)]
    assert clinic._judge("driver.py:29", where)
    assert not clinic._judge("../../install/p/lib/python3.11/site-packages/ros2_robot_controller/driver.py:29", where)


@pytest.mark.slow  # a patient more
@pytest.mark.ros
@pytest.mark.sandbox
def test_a_treated_patient_comes_back_as_it_was_left(ward: Workspace, capsys: pytest.CaptureFixture[str]):
    clinic.admit("C6")
    cure("C6")
    clinic.admit("C7")
    clinic.admit("C6")
    assert "back as you left it" in capsys.readouterr().out
    text = Path("ros2_robot_controller/driver.py").read_text()
    assert text == checkpoint_texts.solution("10", "ros2_robot_controller/driver.py")
    clinic.admit("C6", fresh=True)
    assert Path("ros2_robot_controller/driver.py").read_text() != text


@pytest.mark.ros
@pytest.mark.sandbox
def test_a_kit_without_solutions_says_that_it_has_no_patients(
    ward: Workspace, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    monkeypatch.setattr(checkpoints, "entry_points", lambda **_: [])
    clinic.admit("C1")
    assert "holds no solutions" in capsys.readouterr().out


def edit(path: str, old: str, new: str) -> None:
    replace(path, old, new)(Path(PACKAGE))


@pytest.mark.ros
@pytest.mark.sandbox
@pytest.mark.slow  # runs a node: this process crashed in one run of nine, and why is not known
def test_a_cure_of_the_sign_is_refused_with_what_was_seen(ward: Workspace):
    """With older scans allowed it no longer jerks, and drives blind."""
    clinic.admit("C6")
    edit("driver.py", "STALE_S = 0.5", "STALE_S = 5.0")
    answer = repr(clinic.check("C6", diagnosis("C6")))
    assert "after a scan of 0.8 s ago" in answer
    assert "slows down" not in answer


@pytest.mark.ros
@pytest.mark.sandbox
@pytest.mark.slow  # runs a node: this process crashed in one run of nine, and why is not known
def test_another_cure_than_the_solutions_is_accepted(ward: Workspace):
    clinic.admit("C9")
    edit(
        "navigator.py",
        "        self._goal = None\n        self._speed = 0.0",
        "        if self._goal is goal:\n            self._goal = None\n            self._speed = 0.0",
    )
    assert repr(clinic.check("C9", diagnosis("C9"))) == "C9 passed"
