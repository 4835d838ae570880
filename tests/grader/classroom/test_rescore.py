"""Judging a class once more from its evidence, and saying what changed."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path

import pytest
from helpers import recordings

from grader import evidence, pipeline, report
from grader.classroom import gradebook
from grader.classroom.class_folder import RUBRIC, ClassFacts, ClassFolder, Entry, Record, Status
from grader.classroom.rescore import rescore
from grader.classroom.roster import Person
from grader.errors import GraderError
from grader.scoring import rubric
from grader.settings import Settings


@pytest.fixture(scope="module")
def graded(tmp_path_factory) -> Path:
    """Return a class with the reference's recording as its only submission."""
    folder = ClassFolder(tmp_path_factory.mktemp("class"))
    settings = Settings(rubric=rubric.load(rubric.RUBRIC), cache=folder.path)
    (folder.path / RUBRIC).write_text(rubric.RUBRIC.read_text())
    entry = Entry("team07", "team07", Path("team07.zip"), "a" * 64, (Person("s1"),))
    folder.write_facts(ClassFacts("Robots", "x", "plain", settings.rubric.sha256, "k", "0", "", 0, (entry,)))
    made = folder.working("team07")
    evidence.save(recordings.load("reference"), made / pipeline.EVIDENCE)
    report.write(pipeline.judge(made / pipeline.EVIDENCE, settings), made, pictures=False)
    folder.keep(made, Record("team07", Status.GRADED, rubric=settings.rubric.sha256))
    return folder.path


@pytest.fixture
def again(graded: Path, tmp_path: Path) -> ClassFolder:
    shutil.copytree(graded, tmp_path / "class")
    return ClassFolder(tmp_path / "class")


@pytest.mark.slow  # a class is judged twice
def test_the_same_rubric_and_checks_give_the_same_points_and_other_evidence_others(again: ClassFolder):
    assert rescore(again) == (1, [])
    functions = again.submission("team07") / pipeline.EVIDENCE / "functions.json"
    answers = json.loads(functions.read_text())
    functions.write_text(json.dumps([each | {"answer": [9.0 for _ in each["answer"]]} for each in answers]))
    assert rescore(again) == (1, [("team07", "F14", "1.00", "0.00")])


def test_a_new_rubric_counts_and_is_kept_with_the_class(again: ClassFolder, graded: Path, tmp_path: Path):
    text = rubric.RUBRIC.read_text()
    old = '{id: "check_idle::test_publishes_zero_without_a_command", points: 1.5,'
    other = '{id: "check_idle::test_publishes_at_the_control_rate", points: 1.5,'
    assert text.count(old) == text.count(other) == 1
    text = text.replace(old, old.replace("1.5", "2")).replace(other, other.replace("1.5", "1"))
    (tmp_path / "new.yaml").write_text(text)
    rescore(again, new_rubric=tmp_path / "new.yaml")
    assert (again.path / RUBRIC).read_text() == text
    record = again.record("team07")
    assert record is not None
    assert record.rubric == again.facts().rubric == rubric.load(tmp_path / "new.yaml").sha256
    assert gradebook.read(again).rows[0].total == gradebook.read(ClassFolder(graded)).rows[0].total


def test_evidence_that_was_not_collected_is_named_with_the_command_that_collects_it(again: ClassFolder):
    for path in (again.submission("team07") / pipeline.EVIDENCE / "trials").glob("idle*.json"):
        path.unlink()
    with pytest.raises(GraderError, match=r"team07 lacks evidence of the trial idle.* `grader batch --out CLASS"):
        rescore(again)


@pytest.mark.slow  # a class is judged
def test_ctrl_c_while_judging_leaves_the_class_as_it_was(again: ClassFolder, tmp_path: Path):
    def interrupt(_done: int, _total: int) -> None:
        raise KeyboardInterrupt

    (tmp_path / "new.yaml").write_text(rubric.RUBRIC.read_text().replace("points: 1.5,", "points: 1.50,"))
    before = {path: path.read_bytes() for path in sorted(again.submission("team07").rglob("*")) if path.is_file()}
    with pytest.raises(KeyboardInterrupt):
        rescore(again, new_rubric=tmp_path / "new.yaml", progress=interrupt)
    assert {path: path.read_bytes() for path in before} == before
    assert (again.path / RUBRIC).read_text() == rubric.RUBRIC.read_text()


@pytest.mark.slow  # a class is judged twice
@pytest.mark.parametrize("status", [Status.REFUSED, Status.ERROR])
def test_a_rescore_turned_cannot_be_graded_into_not_graded_yet(again: ClassFolder, tmp_path: Path, status: Status):
    """Only the graded ones got the new rubric's hash; whoever had 0 and a reason lost both."""
    facts = again.facts()
    entry = Entry("boek", "boek", Path("boek.zip"), "b" * 64, (Person("s3"),))
    again.write_facts(replace(facts, entries=(*facts.entries, entry)))
    again.keep(again.working("boek"), Record("boek", status, "boek.zip is empty.", entry.content, facts.rubric))
    before = next(row for row in gradebook.read(again).rows if row.submission == "boek")
    (tmp_path / "new.yaml").write_text(rubric.RUBRIC.read_text() + "# another one\n")
    rescore(again, new_rubric=tmp_path / "new.yaml")
    after = next(row for row in gradebook.read(again).rows if row.submission == "boek")
    assert (after.state, after.total, after.why) == (before.state, before.total, before.why)
    assert after.why == "boek.zip is empty."
