"""Judging a class once more from its evidence, and saying what changed."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from grader import pipeline
from grader.classroom import gradebook
from grader.classroom.class_folder import RUBRIC, ClassFolder, Entry, Record, Status
from grader.classroom.hand_ins import rescore
from grader.classroom.roster import Person
from grader.errors import GraderError
from grader.scoring import rubric


@pytest.mark.slow  # a class is judged twice
def test_the_same_rubric_and_checks_give_the_same_points_and_other_evidence_others(judged: ClassFolder):
    assert rescore(judged) == (1, [])
    functions = judged.submission("team07") / pipeline.EVIDENCE / "functions.json"
    answers = json.loads(functions.read_text())
    functions.write_text(json.dumps([each | {"answer": [9.0 for _ in each["answer"]]} for each in answers]))
    assert rescore(judged) == (1, [("team07", "F14", "1.00", "0.00")])


def test_a_new_rubric_counts_and_is_kept_with_the_class(judged: ClassFolder, judged_once: Path, tmp_path: Path):
    text = rubric.RUBRIC.read_text()
    old = '{id: "check_idle::test_publishes_zero_without_a_command", points: 1.5,'
    other = '{id: "check_idle::test_publishes_at_the_control_rate", points: 1.5,'
    assert text.count(old) == text.count(other) == 1
    text = text.replace(old, old.replace("1.5", "2")).replace(other, other.replace("1.5", "1"))
    (tmp_path / "new.yaml").write_text(text)
    rescore(judged, new_rubric=tmp_path / "new.yaml")
    assert (judged.path / RUBRIC).read_text() == text
    record = judged.record("team07")
    assert record is not None
    assert record.rubric == judged.facts().rubric == rubric.load(tmp_path / "new.yaml").sha256
    assert gradebook.read(judged).rows[0].total == gradebook.read(ClassFolder(judged_once)).rows[0].total


def test_evidence_that_was_not_collected_is_named_with_the_command_that_collects_it(judged: ClassFolder):
    for path in (judged.submission("team07") / pipeline.EVIDENCE / "trials").glob("idle*.json"):
        path.unlink()
    with pytest.raises(GraderError, match=r"team07 lacks evidence of the trial idle.* `grader batch --out CLASS"):
        rescore(judged)


@pytest.mark.slow  # a class is judged
def test_ctrl_c_while_judging_leaves_the_class_as_it_was(judged: ClassFolder, tmp_path: Path):
    def interrupt(_done: int, _total: int) -> None:
        raise KeyboardInterrupt

    (tmp_path / "new.yaml").write_text(rubric.RUBRIC.read_text().replace("points: 1.5,", "points: 1.50,"))
    before = {path: path.read_bytes() for path in sorted(judged.submission("team07").rglob("*")) if path.is_file()}
    with pytest.raises(KeyboardInterrupt):
        rescore(judged, new_rubric=tmp_path / "new.yaml", progress=interrupt)
    assert {path: path.read_bytes() for path in before} == before
    assert (judged.path / RUBRIC).read_text() == rubric.RUBRIC.read_text()


@pytest.mark.slow  # a class is judged twice
@pytest.mark.parametrize("status", [Status.REFUSED, Status.ERROR])
def test_a_rescore_turned_cannot_be_graded_into_not_graded_yet(judged: ClassFolder, tmp_path: Path, status: Status):
    """Only the graded ones got the new rubric's hash; whoever had 0 and a reason lost both."""
    facts = judged.facts()
    entry = Entry("boek", "boek", Path("boek.zip"), "b" * 64, (Person("s3"),))
    judged.write_facts(replace(facts, entries=(*facts.entries, entry)))
    judged.keep(judged.working("boek"), Record("boek", status, "boek.zip is empty.", entry.content, facts.rubric))
    before = next(row for row in gradebook.read(judged).rows if row.submission == "boek")
    (tmp_path / "new.yaml").write_text(rubric.RUBRIC.read_text() + "# another one\n")
    rescore(judged, new_rubric=tmp_path / "new.yaml")
    after = next(row for row in gradebook.read(judged).rows if row.submission == "boek")
    assert (after.state, after.total, after.why) == (before.state, before.total, before.why)
    assert after.why == "boek.zip is empty."
