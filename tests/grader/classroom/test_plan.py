"""What a run will do is shown before it does it, and kept as plan.csv; how it went is in batch.log."""

from __future__ import annotations

import csv
import re
from dataclasses import replace
from pathlib import Path

import pytest
from helpers import beside
from helpers.archives import write
from helpers.class_reports import graded

from grader import cli
from grader.classroom import batch, plan
from grader.classroom.class_folder import Entry, Record, Status
from grader.classroom.one_grading import Ending, Order
from grader.classroom.plan import Action, Options

TEXTS = beside(__file__)

ROSTER = """id,name,email,login,team
s1,Jane Doe,jane@uni.edu,jdoe,
s2,Li Wu,li@uni.edu,liwu,team07
s3,Eva Ost,eva@uni.edu,eost,team07
s4,Bo Ek,bo@uni.edu,boek,
"""
EXTENSION = """people:
  s3:
    extension: {until: "2026-11-25T23:59+00:00", why: ill, by: A. Lovelace}
"""


@pytest.fixture
def export(tmp_path) -> list[str]:
    """Return the words of a `grader batch` over an export of Gradescope, with a resubmission, a team and a stranger."""
    handed_in = {f"submission_{number}/readme": str(number) for number in range(1, 5)}
    write(tmp_path / "export", {"submission_metadata.yml": TEXTS["METADATA"], **handed_in})
    (tmp_path / "roster.csv").write_text(ROSTER)
    return [
        *("batch", str(tmp_path / "export"), "--roster", str(tmp_path / "roster.csv")),
        *("--deadline", "2026-11-20T23:59+00:00", "--late", "10 % per started day", "--out", str(tmp_path / "class")),
    ]


def rows(tmp_path: Path) -> dict[str, dict[str, str]]:
    with (tmp_path / "class" / "plan.csv").open(encoding="utf-8") as stream:
        return {row["people"] or row["label"]: row for row in csv.DictReader(stream)}


def test_a_plan_grades_nothing_and_writes_nothing_but_the_plan(tmp_path, export, workers, capsys):
    made = workers(graded)
    assert cli.main([*export, "--plan"]) == 0
    assert made.orders == []
    assert [path.name for path in (tmp_path / "class").iterdir()] == ["plan.csv"]
    said = capsys.readouterr().out
    assert "3 submissions: 0 kept, 3 to be graded, about " in said
    assert f"Plan: {tmp_path / 'class' / 'plan.csv'}" in said


def test_a_plan_without_a_class_is_only_printed(tmp_path, export, capsys, monkeypatch):
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    assert cli.main([*export[:-2], "--plan"]) == 0
    assert "Jane Doe" in capsys.readouterr().out
    assert list((tmp_path / "here").iterdir()) == []


def test_the_plan_says_whose_which_hand_in_counts_how_late_and_what_will_be_done(tmp_path, export, workers):
    (tmp_path / "class").mkdir()
    (tmp_path / "class" / "overrides.yaml").write_text(EXTENSION)
    assert cli.main([*export, "--plan"]) == 0
    plan = rows(tmp_path)
    jane = plan["Jane Doe"]
    assert (jane["id"], jane["submitted"]) == ("jdoe", "2026-11-22 10:00+00:00")
    assert "s1" in jane["matched by"] or "jane@uni.edu" in jane["matched by"]
    assert jane["hand-in"] == "The latest of 2 submissions; not: submission_1."
    assert jane["late"] == "late by 34:01:00, 2 started days"
    assert (jane["will be"], jane["why"]) == ("graded", "not graded yet")
    team = plan["Li Wu, Eva Ost"]
    assert team["late"] == "Li Wu: late by 8:31:00, 1 started day; Eva Ost: in time, with an extension"
    assert (plan["Bo Ek"]["will be"], plan["Bo Ek"]["why"]) == ("not graded yet", "unless Nemo is theirs")


def test_every_doubt_is_said_in_full_before_anything_is_graded(tmp_path, export, workers, capsys):
    said: list[str] = []

    def grade(order: Order) -> Ending:
        said.append(capsys.readouterr().err)
        return graded(order)

    workers(grade)
    assert cli.main([*export, "--minutes", "20"]) == 0
    assert "3 submissions: 0 kept, 3 to be graded, about " in said[0]
    assert ", 20 minutes for each at most\n" in said[0]
    assert re.search(r"DOUBT: .*(Nemo|submission_4|s99).*overrides\.yaml", said[0])
    assert "graded, 10 s" not in said[0]
    assert (tmp_path / "class" / "plan.csv").exists()


RECORD = Record("a", Status.GRADED, content="c", rubric="r", kit="k", started="2026-11-28T10:00+01:00")
ENTRY = Entry("a", "a", Path("a"), "c")


@pytest.mark.parametrize(
    ("record", "entry", "options", "action", "why"),
    [
        (None, {}, Options(), Action.GRADE, "not graded yet"),
        (None, {"absent": True}, Options(), Action.LEAVE, "not graded yet, but the submission is in none of"),
        (None, {}, Options(only=["b"]), Action.LEAVE, "not graded yet, and not named by --only"),
        ({}, {}, Options(), Action.KEEP, "graded 2026-11-28 10:00"),
        ({"status": Status.ERROR}, {}, Options(), Action.GRADE, "the last run ended in an error"),
        ({"content": "b"}, {}, Options(), Action.GRADE, "handed in again"),
        ({"seed": 7}, {}, Options(), Action.GRADE, "the seed was 7"),
        ({"rubric": "s"}, {}, Options(), Action.GRADE, "the rubric was another one"),
        ({"package": "src/b"}, {}, Options(), Action.GRADE, "another package is to be graded"),
        ({"kit": "l"}, {}, Options(), Action.KEEP, "graded 2026-11-28 10:00; by another kit (l)"),
        ({"kit": "l"}, {}, Options(regrade=True), Action.GRADE, "--regrade"),
        ({}, {}, Options(fresh=True), Action.GRADE, "--fresh"),
        ({}, {}, Options(fresh=True, only=["b"]), Action.KEEP, "graded"),
        ({}, {"absent": True}, Options(fresh=True), Action.KEEP, "graded 2026-11-28 10:00; in an earlier source only"),
        (
            {"status": Status.REFUSED, "rubric": "s", "why": "empty"},
            {},
            Options(),
            Action.KEEP,
            "cannot be graded: emp",
        ),
    ],
)
def test_what_is_done_with_a_submission(record, entry, options, action, why):
    before = None if record is None else replace(RECORD, **record)
    found = plan.decide(replace(ENTRY, **entry), before, RECORD, options)
    assert (found.action, found.why[: len(why)]) == (action, why)


def test_the_estimate_is_that_of_the_class_as_soon_as_it_has_grades(tmp_path, export, workers):
    first = batch.look(tmp_path / "export", tmp_path / "class", None, Options(jobs=1))
    assert first.seconds == 45.0 * len(first.rows)
    workers(graded)
    cli.main(export)
    planned = batch.look(None, tmp_path / "class", None, Options(jobs=2, fresh=True))
    assert planned.seconds == 10.0 * 3 / 2


def test_the_log_of_a_class_has_every_run_with_times(tmp_path, export, workers):
    workers(lambda order: Ending(Status.REFUSED, "is empty") if order.id == "jdoe" else graded(order))
    cli.main(export)
    cli.main(["batch", "--out", str(tmp_path / "class")])
    lines = (tmp_path / "class" / "batch.log").read_text(encoding="utf-8").splitlines()
    assert all(re.match(r"\d{4}-\d\d-\d\d \d\d:\d\d:\d\d[+-]\d\d:\d\d  ", line) for line in lines)
    said = [line[27:] for line in lines]
    assert said[0].startswith("3 submissions: 0 kept, 3 to be graded, about ")
    assert any(re.match(r" +1/3  jdoe +cannot be graded, 0 s: is empty", line) for line in said)
    assert any(line.startswith("3 submissions: 3 kept, 0 to be graded") for line in said)
