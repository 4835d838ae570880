"""`grader forget` removes one person everywhere in a class, and says what it could not remove."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest

from grader import cli
from grader.classroom import forgetting
from grader.classroom.doubt import Doubt, DoubtKind

pytestmark = pytest.mark.slow  # each writes a class

OVERRIDES = """\
# Decisions of the autumn term
submissions:
  boek:
    comments: ["Bo Ek was ill."]

  # the wall stood in the way
  team07:
    comments: ["A fine README."]
people:
  s3: {extension: {until: 2026-11-25T23:59, why: ill, by: A. Lee}}
  # transferred
  s1:
    comments: ["Passed last year."]
"""


@pytest.fixture
def full(class_of_four):
    """Return a class in which Bo Ek is named in every file that the kit writes."""
    folder = class_of_four(OVERRIDES)
    doubt = Doubt(DoubtKind.NO_TIME, "boek", "boek has no time.", "Write it into overrides.yaml.", "boek")
    folder.write_facts(replace(folder.facts(), doubts=(doubt,), notes=("Bo Ek handed in twice.", "x.txt is odd.")))
    (folder.path / "batch.log").write_text("10:00 1/2  boek  graded\n10:01 2/2  team07  graded\n")
    (folder.path / "plan.csv").write_text("id,people\nboek,Bo Ek\nteam07,Jane Doe\n")
    (folder.path / "regrades.yaml").write_text(
        "- {submission: boek, requirement: F4, reason: why}\n- {submission: team07, requirement: F4, reason: why}\n"
    )
    (folder.path / "similar.json").write_text(
        json.dumps({"usual": 0, "pairs": [{"one": "boek", "other": "team07", "share": 0.9}]})
    )
    (folder.path / "similar.html").write_text("boek (Bo Ek)")
    (folder.path / "canvas.csv").write_text("Bo Ek,12347\n")
    return folder


def everything(folder) -> str:
    files = (path for path in sorted(folder.path.rglob("*")) if path.is_file())
    return "\n".join(f"{path.relative_to(folder.path)}\n{path.read_text()}" for path in files)


@pytest.mark.parametrize("name", ["s3", "12347", "BOEK", "bo@uni.edu", "Ek, Bo"])
def test_nothing_of_a_person_stays_in_the_class_and_everything_of_others_does(full, name, capsys):
    assert cli.main(["forget", name, str(full.path), "--yes"]) == 0
    text = everything(full)
    for word in ("boek", "Bo Ek", "bo@uni.edu", "s3", "12347"):
        assert word not in text
    for word in ("team07", "Jane Doe", "Eva Ost", "A fine README.", "Passed last year.", "x.txt is odd."):
        assert word in text
    assert "# the wall stood in the way\n  team07:" in full.overrides.read_text()
    assert "# transferred\n  s1:" in full.overrides.read_text()
    said = capsys.readouterr().out
    assert "removed: submissions/boek" in said
    assert "left: export.zip has what was handed in" in said


def test_nothing_is_removed_before_it_is_confirmed(full, capsys):
    before = everything(full)
    assert cli.main(["forget", "s3", str(full.path)]) == 0
    assert everything(full) == before
    said = capsys.readouterr().out
    assert "to remove: submissions/boek" in said
    assert "Nothing was changed." in said


def test_a_teams_submission_stays_for_the_other_members(full, capsys):
    assert cli.main(["forget", "s1", str(full.path), "--yes"]) == 0
    (team,) = [entry for entry in full.facts().entries if entry.id == "team07"]
    assert [person.id for person in team.people] == ["s2"]
    assert full.submission("team07").is_dir()
    assert "Jane Doe" not in (full.path / "gradebook.csv").read_text()
    assert "Passed last year." not in full.overrides.read_text()
    assert "left: team07 stays: it is the submission of =Li Wu, too" in capsys.readouterr().out


def test_somebody_who_handed_in_nothing_is_forgotten_too(full):
    assert cli.main(["forget", "s4", str(full.path), "--yes"]) == 0
    assert "Eva Ost" not in everything(full)


def test_a_file_that_still_names_the_person_is_named(full, capsys):
    (full.path / "mine.txt").write_text("Bo Ek asked me on Monday")
    assert cli.main(["forget", "s3", str(full.path), "--yes"]) == 0
    assert "left: mine.txt still names them" in capsys.readouterr().out


def test_a_name_that_fits_two_is_refused(full, capsys):
    facts = full.facts()
    full.write_facts(replace(facts, missing=(*facts.missing, replace(facts.missing[0], id="s5", email="", login=""))))
    assert cli.main(["forget", "Eva Ost", str(full.path), "--yes"]) == 3
    assert "Name the person by an id" in capsys.readouterr().err
    assert "s4" in everything(full)


def test_one_person_is_forgotten_in_all_classes_of_a_term(full, tmp_path):
    (tmp_path / "term.yaml").write_text("sheets: [{class: class, weight: 10}]\n")
    assert cli.main(["term", str(tmp_path)]) == 0
    assert "Bo Ek" in (tmp_path / "totals.csv").read_text()
    assert cli.main(["forget", "s3", str(tmp_path), "--yes"]) == 0
    assert "Bo Ek" not in everything(full) + (tmp_path / "totals.csv").read_text()


@pytest.mark.parametrize("name", ["s2", "LIWU", "li@uni.edu", "'12346'"])
@pytest.mark.parametrize(
    ("people", "left"),
    [
        ("people: [{}, s4]  # seen", "people: [s4]  # seen"),
        ("people: [s4, {}]", "people: [s4]"),
        ("people:\n      - s4\n      - {}\n", "people: [s4]\n"),
        ("people: {}", "people: []"),
    ],
)
def test_whom_a_submission_was_assigned_to_is_forgotten_there(class_of_four, people, left, name, capsys):
    """The name stayed in overrides.yaml, and was nobody of the class: no verb could read the file any more."""
    folder = class_of_four(f"submissions:\n  boek:\n    {people.format(name)}\n  team07: {{comments: [Fine.]}}\n")
    assert cli.main(["forget", "s2", str(folder.path), "--yes"]) == 0
    if "s4" in people:
        assert folder.overrides.read_text() == f"submissions:\n  boek:\n    {left}\n  team07: {{comments: [Fine.]}}\n"
    else:
        assert folder.overrides.read_text() == "submissions:\n  team07: {comments: [Fine.]}\n"
        assert not folder.submission("boek").exists(), "it was the person's alone"
    capsys.readouterr()
    assert cli.main(["gradebook", str(folder.path)]) == 0


def test_a_person_who_is_written_otherwise_in_overrides_is_forgotten_there(class_of_four):
    folder = class_of_four('people:\n  "Ost, Eva": {excused: {why: ill, by: Ada}}\n  s1: {comments: [Good.]}\n')
    assert cli.main(["forget", "s4", str(folder.path), "--yes"]) == 0
    assert folder.overrides.read_text() == "people:\n  s1: {comments: [Good.]}\n"


def test_everything_that_was_written_for_platforms_goes_too(full):
    """Feedback is packed, so that no search in text finds who is in it."""
    assert cli.main(["gradebook", str(full.path), "--for", "moodle", "--feedback"]) == 0
    assert cli.main(["gradebook", str(full.path), "--anonymous"]) == 0
    written = {"moodle.csv", "moodle_feedback.zip", "anonymous", "anonymous_key.csv"}
    assert written <= {path.name for path in full.path.iterdir()}
    assert cli.main(["forget", "s3", str(full.path), "--yes"]) == 0
    assert not written & {path.name for path in full.path.iterdir()}


def test_a_name_between_underscores_is_found(full, capsys):
    (full.path / "mine.txt").write_text("Bo Ek_12347_file, O&#39;Ek")
    assert cli.main(["forget", "s3", str(full.path), "--yes"]) == 0
    assert "left: mine.txt still names them" in capsys.readouterr().out


def test_whoever_is_in_one_class_of_a_term_only_is_forgotten_there(full, tmp_path, capsys):
    """It ended with an error at the class without the person, when others were changed already."""
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "rubric.yaml").write_text((full.path / "rubric.yaml").read_text())
    full.__class__(tmp_path / "other").write_facts(replace(full.facts(), entries=(), missing=(), roster=(), doubts=()))
    (tmp_path / "term.yaml").write_text("sheets: [{class: other, weight: 10}, {class: class, weight: 10}]\n")
    assert cli.main(["forget", "s3", str(tmp_path), "--yes"]) == 0
    assert f"{tmp_path / 'other'}: nothing about s3" in capsys.readouterr().out
    assert "boek" not in everything(full)
    assert cli.main(["forget", "s3", str(tmp_path), "--yes"]) == 3
    assert "The term's classes have nobody called s3" in capsys.readouterr().err


def test_a_block_that_is_cut_out_takes_no_other_line_with_it():
    assert (
        forgetting.cut("people:\n  a:\n    x: 1\n\n# end\nb: 1\n", "people", ["a"].__contains__)
        == "people:\n\n# end\nb: 1\n"
    )
