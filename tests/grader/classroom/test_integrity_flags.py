"""A flag names what it concerns and takes no points; by `flags: withhold` they wait until a person decides."""

from __future__ import annotations

import shutil
from dataclasses import replace
from decimal import Decimal
from pathlib import Path

import pytest
from helpers import recordings
from helpers.class_reports import report
from helpers.course import COURSE

from grader import evidence, pipeline
from grader import report as report_room
from grader.checks import checks_run
from grader.classroom import gradebook, hand_ins, overview
from grader.classroom.class_folder import ClassFolder
from grader.classroom.gradebook import Row, State
from grader.classroom.hand_ins import rescore
from grader.classroom.platforms import canvas, github, gradescope, plain
from grader.evidence import Flag
from grader.notebook import checking
from grader.notebook.feedback import Note
from grader.report import console, data, html, without_what_is_held_back
from grader.scoring import rubric
from grader.scoring.grading import Grading
from grader.scoring.rubric import Rubric
from grader.scoring.scorecard import CheckResult, Outcome, decided, score
from grader.settings import Settings

FLAGS = [
    Flag("hidden text", "300 words are in a comment", "README.md", concerns=["readme"]),
    Flag("made at run time", "`exec` ran text", "robot/magic.py", "wall_fast", ["student tests", "mutation"]),
]
CONCERNED = ["Q5", "T1", "T2", "T3"]
WITHHOLD = rubric.RUBRIC.read_text() + "\nflags: withhold\n"


@pytest.fixture(scope="module")
def withholding(tmp_path_factory: pytest.TempPathFactory) -> Rubric:
    path = tmp_path_factory.mktemp("rubric") / "rubric.yaml"
    path.write_text(WITHHOLD)
    return rubric.load(path)


@pytest.fixture(scope="module")
def saved(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of the reference's evidence with two flags."""
    folder = tmp_path_factory.mktemp("flagged") / pipeline.EVIDENCE
    evidence.save(replace(recordings.load("reference"), flags=FLAGS), folder)
    return folder


@pytest.fixture(scope="module")
def noted(saved: Path) -> Grading:
    return pipeline.judge(saved, Settings(rubric=rubric.load(rubric.RUBRIC), cache=saved))


@pytest.fixture(scope="module")
def withheld(saved: Path, withholding: Rubric, noted: Grading) -> Grading:
    results = data.results(data.as_data(noted))
    only = Settings(rubric=withholding, cache=saved, requirements=("I2",))  # one check is judged again
    return pipeline.judge(saved, only, [result for result in results if not result.id.startswith("check_package_xml")])


# -- one grading ------------------------------------------------------------------------------------------------------


def test_a_flag_takes_no_points_and_names_file_trial_and_requirements(noted: Grading):
    assert noted.scorecard.points == noted.scorecard.max == 100
    text = " ".join(console.render(noted).split())
    assert "hidden text: 300 words are in a comment (README.md; concerns Q5)" in text
    assert "(robot/magic.py; trial wall_fast; concerns T1, T2, T3)" in text
    assert "A flag takes no points by itself." in text
    page = html.render(noted)
    assert page.index("concerns T1, T2, T3") < page.index('class="score"')
    assert data.as_data(noted)["flags"] == "note"
    assert data.as_data(noted)["integrity"][1] == {
        "kind": "made at run time", "what": "`exec` ran text", "where": "robot/magic.py", "trial": "wall_fast",
        "requirements": ["T1", "T2", "T3"],
    }  # fmt: skip


@pytest.mark.parametrize(
    ("concerns", "requirements"),
    [
        ("what ran", {"Q1", "Q2", "Q3", "Q4", "T1", "T2", "T3"}),
        ("student tests", {"T1", "T2", "T3"}),
        ("mutation", {"T3"}),
        ("readme", {"Q5"}),
    ],
)
def test_what_a_flag_concerns_is_what_its_checks_need(concerns: str, requirements: set[str]):
    assert checks_run.served(COURSE, rubric.load(rubric.RUBRIC), concerns) == requirements


def test_points_are_withheld_and_not_lost(withheld: Grading):
    card = withheld.scorecard
    assert [s.requirement.id for s in card.requirements if s.outcome is Outcome.WITHHELD] == CONCERNED
    assert (card.points, card.max, withheld.worth) == (82, 82, 100)
    text = console.render(withheld)
    assert "The points of Q5, T1, T2, T3 are withheld until a person decides." in text
    assert "withheld     Q5   README" in text
    assert "  – / 3" in text
    assert "82 of 82 graded so far; 100 when all is" in text
    assert html.render(withheld).count("The points of Q5, T1, T2, T3 are withheld until a person decides.") == 2


def test_what_has_no_points_to_keep_and_an_error_of_ours_stay_as_they_are(withholding: Rubric, noted: Grading):
    (q5,) = (r for r in withholding.requirements if r.id == "Q5")
    for outcome in (Outcome.FAILED, Outcome.ERROR):
        results = [CheckResult(check.id, outcome, 0.0) for check in q5.checks]
        (found,) = (s for s in score(withholding, results, {"Q5"}).requirements if s.requirement.id == "Q5")
        assert found.outcome is outcome


def test_a_decision_gives_the_points(withheld: Grading):
    card = decided(withheld.scorecard, {"Q5": 3.0, "T1": 4.0, "T2": 5.0, "T3": 0.0})
    assert (card.points, card.max) == (94, 100)
    assert not any(score.withheld for score in card.requirements)


def test_a_student_is_not_told_what_was_seen_in_a_trial_that_is_held_back(withheld: Grading):
    """A node chooses the names of the code that it makes, and could tell there what it sees."""
    both = Flag("made at run time", "text: x_3_2", "a.py", "wall_fast, wall_slow", ["mutation"])
    made = replace(withheld, evidence=replace(withheld.evidence, flags=[*FLAGS, both]), held_back=("wall_fast",))
    shown = without_what_is_held_back(made).evidence.flags
    assert [(flag.what, flag.where, flag.trial) for flag in shown] == [
        ("300 words are in a comment", "README.md", ""),
        ("text", "a.py", "wall_slow"),
    ]


def test_a_notebook_says_why_points_are_withheld(withheld: Grading):
    (q5,) = (s for s in withheld.scorecard.requirements if s.requirement.id == "Q5")
    answer = checking._judged(q5, withheld, "10_a_package_to_hand_in")
    assert (answer.passed, answer.points) == (False, "0")
    assert answer.notes[-1] == Note(
        "withheld until a person decides", (("seen", "hidden text: 300 words are in a comment"),)
    )


# -- a class ----------------------------------------------------------------------------------------------------------


@pytest.fixture
def held(class_of_four, withheld: Grading, saved: Path) -> ClassFolder:
    """Return a class of which one submission has points withheld."""
    folder = class_of_four(rubric=WITHHOLD)
    shutil.copytree(saved, folder.submission("team07") / pipeline.EVIDENCE)
    report_room.write(withheld, folder.submission("team07"), pictures=False)
    return folder


def team(folder: ClassFolder) -> Row:
    return gradebook.read(folder).teams["team07"]


def test_a_total_with_withheld_points_is_no_grade(held: ClassFolder, tmp_path: Path):
    row = team(held)
    assert (row.state, row.total, row.final, row.grade) == (State.WITHHELD, None, False, "")
    assert row.comment == "the points of Q5, T1, T2, T3 are withheld until a person decides"
    assert canvas._score(row) == ""
    plain.write(gradebook.read(held), tmp_path / "book.csv")
    line = next(line for line in (tmp_path / "book.csv").read_text().splitlines() if "jdoe" in line)
    assert line.count("withheld,") == len(CONCERNED)
    assert "withheld until a person decides" in line


def test_the_class_page_says_on_top_what_waits_and_how_to_decide(held: ClassFolder):
    book = gradebook.read(held)
    page = overview.write(held, book).read_text()
    assert page.index("concerns T1, T2, T3") < page.index('id="totals"')
    assert "in Q5, T1, T2, T3. In <code>overrides.yaml</code>" in page
    assert "team07: {flags_accepted: {why: ..., by: ...}}" in page


@pytest.mark.parametrize(
    ("decision", "total"),
    [
        ("flags_accepted: {why: a generated parser, by: Ada}", "100.00"),
        ("points: {Q5: &no {points: 0, why: hidden, by: Ada}, T1: *no, T2: *no, T3: *no}", "82.00"),
        ("{flags_accepted: {why: a parser, by: Ada}, points: {Q5: {points: 1, why: hidden, by: Ada}}}", "98.00"),
    ],
)
def test_a_person_decides_by_overrides(held: ClassFolder, decision: str, total: str):
    held.overrides.write_text(f"submissions: {{team07: {decision if decision[0] == '{' else f'{{{decision}}}'}}}\n")
    row = team(held)
    assert (row.state, row.total) == (State.GRADED, Decimal(total))
    assert hand_ins.refresh(held) == ["team07"]
    said = held.report("team07")
    assert said is not None
    assert [each["points"] for each in said["hand_in"]["finals"]] == [float(total)]
    page = (held.submission("team07") / "report.html").read_text()
    assert "withheld until a person decides" not in page


def test_points_stay_withheld_for_what_was_not_decided(held: ClassFolder):
    held.overrides.write_text("submissions: {team07: {points: {Q5: {points: 0, why: hidden, by: Ada}}}}\n")
    assert (team(held).state, team(held).total) == (State.WITHHELD, None)


@pytest.mark.slow  # checks are run again
def test_a_rescore_without_it_gives_the_points_back(held: ClassFolder, tmp_path: Path):
    (tmp_path / "note.yaml").write_text(WITHHOLD.replace("flags: withhold", "flags: note"))
    _, changes = rescore(held, new_rubric=tmp_path / "note.yaml")
    assert ("team07", "Q5", "withheld", "3.00") in changes
    assert (team(held).state, team(held).total) == (State.GRADED, 100)


# -- platforms without a person behind them ---------------------------------------------------------------------------


@pytest.mark.parametrize(("withholds", "do"), [(False, "take no points by"), (True, "withhold points until a person")])
def test_gradescope_and_github_say_what_flags_do(noted: Grading, withheld: Grading, withholds: bool, do: str):
    made = data.as_data(withheld if withholds else noted)
    book = gradebook.of_one(made, rubric.load(rubric.RUBRIC))  # the course's own rubric may say something else
    (row,), whole = book.rows, book.rubric
    results = gradescope.results(row, whole, made)
    assert f"2 integrity flags (flags: {'withhold' if withholds else 'note'}): they {do}" in results["output"]
    assert results["extra_data"]["flags_do"] == ("withhold" if withholds else "note")
    assert results["score"] == (82.0 if withholds else 100.0)
    tests = {test["name"].split()[0]: test for test in results["tests"]}
    assert ("score" in tests["T1"], tests["T1"]["output"]) == (
        (False, "withheld until a person decides") if withholds else (True, "")
    )
    for text in (github.workflow_commands(row, whole, made), github.summary(row, whole, made)):
        assert do in text
    assert ("| T1 Tests for both nodes | withheld |" in github.summary(row, whole, made)) is withholds


def test_without_a_flag_nothing_is_said_of_flags(tmp_path: Path):
    whole = rubric.load(rubric.RUBRIC)
    (row,) = gradebook.of_one(report(), whole).rows
    assert "flag" not in gradescope.results(row, whole, report())["output"]
    assert "flag" not in github.summary(row, whole, report())
