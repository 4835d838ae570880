"""Every check of the rubric, on recorded evidence: the reference passes it, a named known-bad submission does not.

The table of check and submission is submissions/known_bad.yaml; tests/evidence holds the recordings.
"""

from __future__ import annotations

from pathlib import Path

import pytest
from helpers import judging, recordings
from submissions.edits import EDITS, FAILS_ON
from submissions.record import REFERENCE

from grader import KIT
from grader.scoring import rubric

REQUIREMENT_OF = {
    check.id: requirement.id
    for requirement in rubric.load(KIT / "rubric.yaml").requirements
    for check in requirement.checks
}
EVERY_CHECK = pytest.mark.parametrize("check", REQUIREMENT_OF)


@EVERY_CHECK
def test_the_reference_passes(check: str):
    said = judging.ask(judging.find(check), recordings.load(REFERENCE))
    assert said.share == 1, said.seen


@EVERY_CHECK
def test_a_known_bad_submission_does_not_get_all_its_points(check: str):
    said = judging.ask(judging.find(check), recordings.load(FAILS_ON[check]))
    assert said.share < 1
    assert said.seen


@EVERY_CHECK
def test_every_check_says_in_a_sentence_what_is_expected(check: str):
    sentence = (judging.find(check).__doc__ or "").strip()
    assert sentence.endswith(".")


def test_each_check_of_the_rubric_has_one_known_bad_submission():
    assert sorted(check for edit in EDITS.values() for check in edit.fails) == sorted(REQUIREMENT_OF)


def test_a_known_bad_submission_costs_the_requirement_of_its_check():
    wrong = {check: name for check, name in FAILS_ON.items() if REQUIREMENT_OF[check] not in EDITS[name].costs}
    assert wrong == {}


def test_the_recordings_are_those_of_the_table():
    assert recordings.names() == {REFERENCE, *FAILS_ON.values()}


@pytest.mark.parametrize("name", [REFERENCE, *dict.fromkeys(FAILS_ON.values())])
def test_a_recording_loads_with_the_classes_of_today(name: str):
    named = "robot_controller" if name == "renames_the_package" else "ros2_robot_controller"
    assert recordings.load(name).intake.package == named


def test_a_recording_of_other_classes_says_how_to_record_it_again(tmp_path: Path):
    text = recordings.read(recordings.FOLDER / "silent_when_idle.json.xz")
    recordings.write(tmp_path / "old.json.xz", text.replace('"log_tail"', '"log"'))
    with pytest.raises(AssertionError, match=r"submissions\.record old"):
        recordings.load("old", tmp_path)
