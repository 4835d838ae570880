"""A request to look again: recorded, shown with its evidence, decided, and in the report."""

from __future__ import annotations

import json
from decimal import Decimal

import pytest
import yaml

from grader import cli
from grader.classroom import gradebook, regrades
from grader.errors import GraderError
from grader.scoring import rubric

REASON = "the wall stood, at once, in the start: {7}"


def points(folder, requirement: str = "F4"):
    row = next(row for row in gradebook.read(folder).rows if row.submission == "team07")
    return next(each.points for each in row.requirements if each.id == requirement), row.comment


def run(*words: object) -> int:
    return cli.main(["regrade", *map(str, words)])


def test_a_request_is_recorded_and_listed_until_it_is_decided(class_of_four, capsys):
    folder = class_of_four()
    assert run(folder.path, "team07", "F4", "--reason", REASON) == 0
    assert run(folder.path) == 0
    said = capsys.readouterr().out
    assert REASON in said
    assert "requests: 1 open, 0 decided" in said
    assert REASON in (folder.path / "index.html").read_text()
    assert points(folder)[0] == Decimal("3.00")
    assert "not decided yet" in points(folder)[1]  # the student sees that it was heard


def test_a_decision_changes_points_gradebook_and_page(class_of_four):
    folder = class_of_four()
    run(folder.path, "team07", "F4", "--reason", REASON)
    assert run(folder.path, "team07", "F4", "--points", "4.5", "--why", "so it did", "--by", "A. Lee") == 0
    found, comment = points(folder)
    assert found == Decimal("4.50")
    assert "so it did; asked because: the wall stood" in comment
    assert "not decided yet" not in (folder.path / "index.html").read_text()
    assert "4.50" in (folder.path / "gradebook.csv").read_text()


def test_points_that_stay_are_answered_too(class_of_four):
    folder = class_of_four()
    run(folder.path, "team07", "F4", "--reason", REASON)
    run(folder.path, "team07", "F4", "--why", "the replay shows a contact", "--by", "A. Lee")
    found, comment = points(folder)
    assert found == Decimal("3.00")
    assert "F4 stays as it is after a second look, by A. Lee: the replay shows a contact" in comment


def test_what_people_wrote_into_the_file_stays(class_of_four):
    """It is theirs as well: a comment, and a request that was pasted in."""
    folder = class_of_four()
    path = folder.path / regrades.FILE
    mine = '# by hand\n- {submission: team07, requirement: F2, reason: "why?"}  # by mail\n'
    path.write_text(mine)
    run(folder.path, "team07", "F4", "--reason", REASON)
    assert path.read_text().startswith(mine.rstrip())
    assert [item["requirement"] for item in yaml.safe_load(path.read_text())] == ["F2", "F4"]


def test_overrides_yaml_goes_first_and_a_decision_against_it_is_refused(class_of_four, capsys):
    folder = class_of_four('submissions: {team07: {points: {F4: {points: 1, why: "w", by: "b"}}}}\n')
    assert run(folder.path, "team07", "F4", "--points", "5", "--why", "w", "--by", "b") == 2
    assert "gives team07 1 points for F4" in capsys.readouterr().err
    regrades.add(folder.path, "team07", "F4", points="5", why="w", by="b")
    assert points(folder)[0] == Decimal("1.00")


def test_what_was_seen_and_how_to_see_it_again_is_shown(class_of_four, capsys):
    folder = class_of_four()
    evidence = folder.submission("team07") / "evidence" / "trials" / "creeping.json"
    evidence.parent.mkdir(parents=True)
    evidence.write_text("{}")
    path = folder.submission("team07") / "report.json"
    report = json.loads(path.read_text())
    next(each for each in report["requirements"] if each["id"] == "F4")["checks"][0]["trial"] = "creeping"
    path.write_text(json.dumps(report))
    before = sorted(folder.path.rglob("*"))
    assert run(folder.path, "team07", "F4") == 0
    said = capsys.readouterr().out
    assert "3 of 5 points by the grader" in said
    assert "seen      touched it at 7.3 s" in said
    assert f"evidence: {evidence}" in said
    assert "report.html#F4" in said
    assert f"grader batch --out {folder.path} --only team07 --fresh" in said
    assert sorted(folder.path.rglob("*")) == before


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("{submission: team08, requirement: F4, reason: x}", "team08 is not a submission of this class"),
        ("{submission: team07, requirement: F99, reason: x}", "F99 is not a requirement"),
        ("{submission: team07, requirement: F4, points: 99, why: x, by: y}", "99 is outside 0 to 5"),
        ("{submission: team07, requirement: F4, points: .nan, why: x, by: y}", "not a number"),
        ("{submission: team07, requirement: F4, points: 3, why: x}", "'by' is missing"),
    ],
)
def test_a_mistake_in_the_file_is_named_with_its_line(class_of_four, line: str, words: str):
    folder = class_of_four()
    (folder.path / regrades.FILE).write_text(f"# first\n- {line}\n")
    with pytest.raises(GraderError, match=f"line 2: .*{words}"):
        regrades.read(folder.path, ["team07"], rubric.load(rubric.RUBRIC))


@pytest.mark.parametrize("text", ["6", "nan", "-1", "many"])
def test_points_outside_the_requirement_are_refused_before_anything_is_written(class_of_four, text: str):
    folder = class_of_four()
    assert run(folder.path, "team07", "F4", "--points", text, "--why", "w", "--by", "b") == 2
    assert not (folder.path / regrades.FILE).exists()
