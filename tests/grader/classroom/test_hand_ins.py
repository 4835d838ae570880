"""What a class knows of a submission stands in its report, and a changed decision is written into it."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest
from helpers.report_examples import REFUSED

from grader import pipeline, report
from grader.classroom import command, gradebook, hand_ins
from grader.classroom.class_folder import ClassFolder
from grader.classroom.hand_ins import rescore
from grader.errors import GraderError

DECIDED = (
    'submissions:\n  team07:\n    points:\n      F4: {points: 3.5, why: "the wall stood in the start", by: "A. L."}\n'
)
EXTENDED = 'people:\n  s1:\n    extension: {until: 2026-11-25T23:59:00Z, why: "had influenza", by: "A. L."}\n'


def said(folder: ClassFolder, name: str = "team07") -> dict:
    return json.loads((folder.submission(name) / "report.json").read_text())


def test_people_team_time_and_lateness_are_in_the_report_and_its_data(judged: ClassFolder):
    known = said(judged)["hand_in"]
    assert known["people"] == ["Jane Doe", "Li Wu"]
    assert (known["team"], known["name"]) == ("team07", "Jane Doe_12345_file_/team07.zip")
    assert (known["submitted"], known["deadline"]) == ("2026-11-22 10:00:00+00:00", "2026-11-20 23:59:00+00:00")
    assert known["late"] == "by 34:01:00, 2 started days; the rule is: 10 % per started day, at most 3 days"
    page = (judged.submission("team07") / report.PAGE).read_text()
    for words in ("Jane Doe, Li Wu", "2026-11-22 10:00:00+00:00", "2 started days", "ROS 2 package development"):
        assert words in page


def test_a_decision_is_written_into_the_report_without_running_a_check(judged: ClassFolder, monkeypatch):
    before = said(judged)
    judged.overrides.write_text(DECIDED)
    monkeypatch.setattr("grader.checks.checks_run.subprocess", None)
    assert hand_ins.refresh(judged) == ["team07"]
    after = said(judged)
    assert after["hand_in"].pop("decisions") == [
        {"requirement": "F4", "points": 3.5, "why": "the wall stood in the start", "by": "A. L."}
    ]
    (final,) = after["hand_in"].pop("finals")
    assert final["points"] == pytest.approx(0.8 * (before["total"] - 1.5))
    before["hand_in"].pop("decisions")
    before["hand_in"].pop("finals")
    assert after == before
    page = (judged.submission("team07") / report.PAGE).read_text()
    assert "<strong>F4</strong>: 3.5 points, by A. L.: the wall stood in the start" in page
    assert "<del>5</del> 3.5 / 5" in page
    assert (judged.submission("team07") / pipeline.EVIDENCE / "build.json").exists()
    assert hand_ins.refresh(judged) == [], "nothing has changed since"


def test_a_decision_on_a_refusal_stands_in_its_report(judged: ClassFolder):
    judged.overrides.write_text(DECIDED.replace("team07", "team08"))
    assert hand_ins.refresh(judged) == ["team08"]
    after = said(judged, "team08")
    assert after["hand_in"]["decisions"][0]["points"] == 3.5
    assert after["refused"] == {"because": REFUSED.because, "try": REFUSED.try_}
    assert "the wall stood in the start" in (judged.submission("team08") / report.PAGE).read_text()


def finals(folder: ClassFolder) -> list[tuple[list[str], float | None]]:
    return [(final["people"], final["points"]) for final in said(folder)["hand_in"]["finals"]]


def test_the_figure_on_the_page_is_the_gradebooks(judged: ClassFolder):
    """The page showed the points measured, so 26.36 where the gradebook had 24.30 after lateness."""
    hand_ins.refresh(judged)
    total = gradebook.read(judged).rows[0].total
    assert total is not None
    assert float(total) == pytest.approx(0.8 * said(judged)["total"], abs=0.01)
    assert finals(judged) == [([], float(total))]
    page = (judged.submission("team07") / report.PAGE).read_text()
    assert f"Final: {float(total):g} of 100" in page
    assert "2 started days late" in page


def test_a_members_extension_is_a_figure_of_their_own_and_no_reason_on_the_teams_page(judged: ClassFolder):
    judged.overrides.write_text(EXTENDED)
    hand_ins.refresh(judged)
    measured = said(judged)["total"]
    (jane, full), (li, less) = finals(judged)
    assert (jane, full, li) == (["Jane Doe"], pytest.approx(measured), ["Li Wu"])
    assert less == pytest.approx(0.8 * measured, abs=0.01)
    assert said(judged)["hand_in"]["deadline"] == "2026-11-20 23:59:00+00:00"
    page = (judged.submission("team07") / report.PAGE).read_text()
    assert "Final, Li Wu" in page
    assert "influenza" not in page


def test_the_only_member_reads_their_own_extension(judged: ClassFolder):
    facts = judged.facts()
    entries = (replace(facts.entries[0], people=facts.entries[0].people[:1]), *facts.entries[1:])
    judged.write_facts(replace(facts, entries=entries))
    judged.overrides.write_text(EXTENDED)
    hand_ins.refresh(judged)
    known = said(judged)["hand_in"]
    assert known["deadline"] == "2026-11-20 23:59:00+00:00; extended to 2026-11-25 23:59:00+00:00"
    assert known["late"] == ""
    assert "had influenza" in known["finals"][0]["because"][0]


@pytest.mark.slow  # a class is judged
def test_a_rescore_keeps_what_is_known_and_says_when_it_judged_again(judged: ClassFolder):
    judged.overrides.write_text(DECIDED)
    before = said(judged)
    rescore(judged)
    after = said(judged)
    assert after["graded"] == before["graded"]
    assert after["rescored"] >= before["graded"]
    assert after["hand_in"]["decisions"][0]["by"] == "A. L."


def test_the_reports_stay_while_another_run_writes_to_the_class(judged: ClassFolder, capsys):
    judged.overrides.write_text(DECIDED)
    with judged.locked():
        with pytest.raises(GraderError, match="being written by another run"):
            hand_ins.refresh(judged)
        command._refresh(judged)
    assert "note: the reports were left as they are" in capsys.readouterr().err
    assert said(judged)["hand_in"]["decisions"] == []
