"""What a class knows of a submission stands in its report, and a changed decision is written into it."""

from __future__ import annotations

import datetime as dt
import json
import shutil
from dataclasses import replace
from pathlib import Path

import pytest
from helpers import recordings
from helpers.report_examples import REFUSED

from grader import evidence, pipeline, report
from grader.classroom import command, gradebook, hand_ins
from grader.classroom.class_folder import RUBRIC, ClassFacts, ClassFolder, Entry, Record, Status
from grader.classroom.overrides import Decisions
from grader.classroom.rescore import rescore
from grader.classroom.roster import Person
from grader.errors import GraderError
from grader.scoring import rubric
from grader.settings import Settings

DEADLINE = dt.datetime(2026, 11, 20, 23, 59, tzinfo=dt.UTC)
LATER = dt.datetime(2026, 11, 22, 10, 0, tzinfo=dt.UTC)
JANE, LI = Person("s1", "Jane Doe", team="team07"), Person("s2", "Li Wu", team="team07")
DECIDED = (
    'submissions:\n  team07:\n    points:\n      F4: {points: 3.5, why: "the wall stood in the start", by: "A. L."}\n'
)
RULE = "10 % per started day, at most 3 days"


@pytest.fixture(scope="module")
def made_once(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a class with the reference's recording as its only graded submission, and one that was refused."""
    folder = ClassFolder(tmp_path_factory.mktemp("made") / "class")
    whole = rubric.load(rubric.RUBRIC)
    settings = Settings(rubric=whole, cache=folder.path)
    folder.path.mkdir()
    (folder.path / RUBRIC).write_text(rubric.RUBRIC.read_text())
    entries = (
        Entry("team07", "Jane Doe_12345_file_", Path("Jane Doe_12345_file_/team07.zip"), "a" * 64, (JANE, LI), LATER),
        Entry("team08", "team08", Path("team08.zip"), "b" * 64),
    )
    facts = ClassFacts("Robots", "x", "plain", whole.sha256, "k", "0", "", 0, entries, (), (), DEADLINE, RULE)
    folder.write_facts(facts)
    for entry, status in zip(entries, (Status.GRADED, Status.REFUSED), strict=True):
        made = folder.working(entry.id)
        known = hand_ins.hand_in(entry, facts, Decisions())
        if status is Status.GRADED:
            evidence.save(recordings.load("reference"), made / pipeline.EVIDENCE)
            grading = pipeline.judge(made / pipeline.EVIDENCE, settings)
            report.write(grading, made, hand_in=known, pictures=False)
        else:
            report.write(REFUSED, made, hand_in=known)
        folder.keep(made, Record(entry.id, status, content=entry.content, rubric=whole.sha256))
    assert hand_ins.refresh(folder) == ["team07"], "its final figure is known only after the grading"
    return folder.path


@pytest.fixture
def graded(made_once: Path, tmp_path: Path) -> ClassFolder:
    """Return a copy of that class, which a test may change."""
    return ClassFolder(Path(shutil.copytree(made_once, tmp_path / "class")))


def said(folder: ClassFolder, name: str = "team07") -> dict:
    return json.loads((folder.submission(name) / "report.json").read_text())


def test_people_team_time_and_lateness_are_in_the_report_and_its_data(graded: ClassFolder):
    known = said(graded)["hand_in"]
    assert known["people"] == ["Jane Doe", "Li Wu"]
    assert (known["team"], known["name"]) == ("team07", "Jane Doe_12345_file_/team07.zip")
    assert (known["submitted"], known["deadline"]) == ("2026-11-22 10:00:00+00:00", "2026-11-20 23:59:00+00:00")
    assert known["late"] == f"by 34:01:00, 2 started days; the rule is: {RULE}"
    page = (graded.submission("team07") / report.PAGE).read_text()
    for words in ("Jane Doe, Li Wu", "2026-11-22 10:00:00+00:00", "2 started days", "ROS 2 package development"):
        assert words in page


def test_a_decision_is_written_into_the_report_without_running_a_check(graded: ClassFolder, monkeypatch):
    before = said(graded)
    graded.overrides.write_text(DECIDED)
    monkeypatch.setattr("grader.checks.checks_run.subprocess", None)
    assert hand_ins.refresh(graded) == ["team07"]
    after = said(graded)
    assert after["hand_in"].pop("decisions") == [
        {"requirement": "F4", "points": 3.5, "why": "the wall stood in the start", "by": "A. L."}
    ]
    (final,) = after["hand_in"].pop("finals")
    assert final["points"] == pytest.approx(0.8 * (before["total"] - 1.5))
    before["hand_in"].pop("decisions")
    before["hand_in"].pop("finals")
    assert after == before
    page = (graded.submission("team07") / report.PAGE).read_text()
    assert "<strong>F4</strong>: 3.5 points, by A. L.: the wall stood in the start" in page
    assert "<del>5</del> 3.5 / 5" in page
    assert (graded.submission("team07") / pipeline.EVIDENCE / "build.json").exists()
    assert hand_ins.refresh(graded) == [], "nothing has changed since"


def test_a_decision_on_a_refusal_stands_in_its_report(graded: ClassFolder):
    graded.overrides.write_text(DECIDED.replace("team07", "team08"))
    assert hand_ins.refresh(graded) == ["team08"]
    after = said(graded, "team08")
    assert after["hand_in"]["decisions"][0]["points"] == 3.5
    assert after["refused"] == {"because": REFUSED.because, "try": REFUSED.try_}
    assert "the wall stood in the start" in (graded.submission("team08") / report.PAGE).read_text()


def finals(folder: ClassFolder) -> list[tuple[list[str], float | None]]:
    return [(final["people"], final["points"]) for final in said(folder)["hand_in"]["finals"]]


def test_the_figure_on_the_page_is_the_gradebooks(graded: ClassFolder):
    """The page showed the points measured, so 26.36 where the gradebook had 24.30 after lateness."""
    hand_ins.refresh(graded)
    total = gradebook.read(graded).rows[0].total
    assert total is not None
    assert float(total) == pytest.approx(0.8 * said(graded)["total"], abs=0.01)
    assert finals(graded) == [([], float(total))]
    page = (graded.submission("team07") / report.PAGE).read_text()
    assert f"Final: {float(total):g} of 100" in page
    assert "2 started days late" in page


def test_a_members_extension_is_a_figure_of_their_own_and_no_reason_on_the_teams_page(graded: ClassFolder):
    graded.overrides.write_text(
        'people:\n  s1:\n    extension: {until: 2026-11-25T23:59:00Z, why: "had influenza", by: "A. L."}\n'
    )
    hand_ins.refresh(graded)
    measured = said(graded)["total"]
    (jane, full), (li, less) = finals(graded)
    assert (jane, full, li) == (["Jane Doe"], pytest.approx(measured), ["Li Wu"])
    assert less == pytest.approx(0.8 * measured, abs=0.01)
    assert said(graded)["hand_in"]["deadline"] == "2026-11-20 23:59:00+00:00"
    page = (graded.submission("team07") / report.PAGE).read_text()
    assert "Final, Li Wu" in page
    assert "influenza" not in page


def test_the_only_member_reads_their_own_extension(graded: ClassFolder):
    facts = graded.facts()
    entries = (replace(facts.entries[0], people=(JANE,)), *facts.entries[1:])
    graded.write_facts(replace(facts, entries=entries))
    graded.overrides.write_text(
        'people:\n  s1:\n    extension: {until: 2026-11-25T23:59:00Z, why: "had influenza", by: "A. L."}\n'
    )
    hand_ins.refresh(graded)
    known = said(graded)["hand_in"]
    assert known["deadline"] == "2026-11-20 23:59:00+00:00; extended to 2026-11-25 23:59:00+00:00"
    assert known["late"] == ""
    assert "had influenza" in known["finals"][0]["because"][0]


@pytest.mark.slow  # a class is judged
def test_a_rescore_keeps_what_is_known_and_says_when_it_judged_again(graded: ClassFolder):
    graded.overrides.write_text(DECIDED)
    before = said(graded)
    rescore(graded)
    after = said(graded)
    assert after["graded"] == before["graded"]
    assert after["rescored"] >= before["graded"]
    assert after["hand_in"]["decisions"][0]["by"] == "A. L."


def test_the_reports_stay_while_another_run_writes_to_the_class(graded: ClassFolder, capsys):
    graded.overrides.write_text(DECIDED)
    with graded.locked():
        with pytest.raises(GraderError, match="being written by another run"):
            hand_ins.refresh(graded)
        command._refresh(graded)
    assert "note: the reports were left as they are" in capsys.readouterr().err
    assert said(graded)["hand_in"]["decisions"] == []
