"""The gradebook: measured points, people's decisions, lateness, and everybody in the class on a line."""

from __future__ import annotations

import datetime as dt
import re
import shutil
from dataclasses import replace
from decimal import Decimal

import pytest
import yaml
from helpers.class_reports import report

from grader import cli
from grader.classroom import gradebook
from grader.classroom.class_folder import CLASS, Doubt, DoubtKind
from grader.classroom.gradebook import Gradebook, Row, State, rounded
from grader.scoring import rubric

SCALED = rubric.RUBRIC.read_text().rstrip() + "\n"
DEADLINE = dt.datetime(2026, 11, 20, 23, 59, tzinfo=dt.UTC)


def row(book: Gradebook, key: str) -> Row:
    (found,) = (row for row in book.rows if row.person.id == key)
    return found


def test_a_team_is_expanded_to_its_members_and_nobody_is_missing(class_of_four):
    book = gradebook.read(class_of_four(zero_missing=True))
    assert [(r.person.id, r.state, r.total) for r in book.rows] == [
        ("s1", State.GRADED, Decimal("98.00")),
        ("s2", State.GRADED, Decimal("98.00")),
        ("s3", State.REFUSED, Decimal("0")),
        ("s4", State.MISSING, Decimal("0")),
    ]
    assert "is empty" in row(book, "s3").comment
    assert "nothing handed in" in row(book, "s4").comment


def test_a_zero_needs_a_person(class_of_four):
    """0.00 went to the platform for whoever was lost on the way, and for a zip that was damaged by the network."""
    folder = class_of_four()
    for who in ("s3", "s4"):
        found = row(gradebook.read(folder), who)
        assert (found.total, found.final) == (None, False)
    folder.overrides.write_text(
        "submissions: {boek: {adjust: {total: 0, why: a picture in a zip, by: Ada}}}\n"
        "people: {s4: {adjust: {total: 0, why: not seen all term, by: Ada}}}\n"
    )
    for who in ("s3", "s4"):
        found = row(gradebook.read(folder), who)
        assert (found.total, found.final) == (0, True)


def test_a_zero_for_all_that_are_missing_is_remembered_and_taken_back(class_of_four, capsys):
    folder = class_of_four()
    command = ["gradebook", str(folder.path)]
    assert cli.main(command) == 0
    said = capsys.readouterr().out
    assert "no grade before a person decides: Bo Ek (cannot be graded), Eva Ost (nothing handed in)" in said
    assert cli.main([*command, "--zero-missing"]) == 0
    assert "no grade before" not in capsys.readouterr().out
    assert [row(gradebook.read(folder), who).total for who in ("s3", "s4")] == [0, 0]
    assert cli.main([*command, "--no-zero-missing"]) == 0
    assert [row(gradebook.read(folder), who).total for who in ("s3", "s4")] == [None, None]


@pytest.mark.parametrize(
    ("value", "shown"), [(2.005, "2.01"), (2.675, "2.68"), (0.125, "0.13"), (2.004999, "2.00"), (3, "3.00")]
)
def test_points_have_two_decimals_half_up(value, shown):
    assert str(rounded(value)) == shown


F4 = "points: {F4: {points: 5, why: the wall stood, by: Ada}}"
EXTENDED = "extension: {until: '2026-11-30T00:00+00:00', why: ill, by: Ada}"
EXCUSED = "excused: {why: passed last year, by: Ada}"


@pytest.mark.parametrize(
    ("team", "people", "late_h", "totals", "said"),
    [
        (F4, "", 0, {"s1": "100.00"}, "F4: 5 points by Ada (the wall stood)"),
        (F4, "", 30, {"s1": "80.00"}, "2 started days late: 20.00 points deducted"),
        (F4, f"s1: {{{EXTENDED}}}", 30, {"s1": "100.00", "s2": "80.00"}, "extension until 2026-11-30"),
        ("submitted: '2026-11-20T12:00+00:00'", "", 200, {"s1": "98.00"}, ""),
        ("", f"s1: {{{EXCUSED}}}, s4: {{{EXCUSED}}}", 0, {"s1": None, "s4": None, "s2": "98.00"}, "passed last year"),
        ("", "s4: {adjust: {total: 61.5, why: oral exam, by: Ada}}", 0, {"s4": "61.50"}, ""),
        ("adjust: {points: -8, why: x, by: Ada}", "", 30, {"s1": "70.40"}, "-8 points by Ada (x)"),
        ("adjust: {points: -90, why: x, by: Ada}", "", 30, {"s1": "0.00"}, ""),
        ("adjust: {points: 90, why: x, by: Ada}", "", 30, {"s1": "100.00"}, ""),
        ("bonus: {points: 90, why: x, by: Ada}", "", 30, {"s1": "168.40"}, "bonus of 90 points"),
        ("adjust: {total: 50, why: x, by: Ada}", "", 30, {"s1": "50.00"}, "total of 50 points by Ada (x)"),
        (
            "adjust: {total: 50, why: x, by: Ada}", "s1: {adjust: {points: 1.5, why: y, by: Bob}}", 30,
            {"s1": "51.50", "s2": "50.00"}, "by Ada (x)",
        ),
        (
            "adjust: {points: -8, why: x, by: Ada}", "s1: {adjust: {total: 60, why: y, by: Bob}}", 30,
            {"s1": "60.00"}, "total of 60 points by Bob (y)",
        ),
        (
            "adjust: {total: 99, why: x, by: Ada}", "s1: {bonus: {points: 2, why: y, by: Bob}}", 30,
            {"s1": "101.00"}, "",
        ),
        (
            "bonus: {points: 30, why: x, by: Ada}", "s1: {adjust: {points: -1, why: y, by: Bob}}", 30,
            {"s1": "107.40"}, "",
        ),
        ("}, boek: {points: {F1: {points: 3, why: seen in the lab, by: Ada}}", "", 0, {"s3": "3.00"}, ""),
    ],
)  # fmt: skip
def test_people_decide(class_of_four, team, people, late_h, totals, said):
    submitted = DEADLINE + dt.timedelta(hours=late_h)
    text = f"submissions: {{team07: {{{team}}}}}\npeople: {{{people}}}\n"
    book = gradebook.read(class_of_four(text, late_rule="10 % per started day", submitted=submitted))
    assert {who: row(book, who).total for who in totals} == {
        who: None if total is None else Decimal(total) for who, total in totals.items()
    }
    assert said in row(book, "s1").comment
    assert {row(book, who).state for who, total in totals.items() if total is None} <= {State.EXCUSED}


def test_no_members_exception_changes_what_the_team_shares(class_of_four):
    """The last row of a team was taken for all of it: one excused member, and the team's repository said 0."""
    folder = class_of_four(
        "people:\n  s1: {adjust: {points: -10, why: absent, by: Ada}}\n  s2: {excused: {why: ill, by: Ada}}\n"
    )
    book = gradebook.read(folder)
    assert [(row(book, key).state, row(book, key).total) for key in ("s1", "s2")] == [
        (State.GRADED, Decimal("88.00")),
        (State.EXCUSED, None),
    ]
    team = book.teams["team07"]
    assert (team.state, team.total, team.comment) == (State.GRADED, Decimal("98.00"), "")
    assert book.apart() == [
        "team07: Jane Doe has 88.00 points, the team 98.00 points",
        "team07: =Li Wu has excused, the team 98.00 points",
    ]


def test_an_extension_of_all_members_is_the_teams(class_of_four):
    folder = class_of_four(
        f"people: {{s1: {{{EXTENDED}}}, s2: {{{EXTENDED}}}}}",
        late_rule="10 % per started day",
        submitted=DEADLINE + dt.timedelta(hours=30),
    )
    book = gradebook.read(folder)
    assert book.teams["team07"].total == Decimal("98.00")
    assert book.apart() == []


def test_a_scale_turns_totals_into_grades(class_of_four):
    scale = "scale:\n  - {grade: '1.0', percent: 95}\n  - {grade: '5.0', percent: 0}\n"
    book = gradebook.read(
        class_of_four("people: {s4: {excused: {why: ill, by: Ada}}}", rubric=SCALED + scale, zero_missing=True)
    )
    assert [(r.person.id, r.grade) for r in book.rows] == [("s1", "1.0"), ("s2", "1.0"), ("s3", "5.0"), ("s4", "")]
    assert row(book, "s1").comment == "grade 1.0"


def test_a_requirement_without_checks_waits_for_a_person(class_of_four):
    data = yaml.safe_load(rubric.RUBRIC.read_text())
    (f4,) = (each for each in data["criteria"][0]["requirements"] if each["id"] == "F4")
    del f4["checks"]
    measured = report()
    (entry,) = (each for each in measured["requirements"] if each["id"] == "F4")
    entry |= {"points": 0.0, "max": 0.0, "outcome": "not_graded", "checks": []}
    folder = class_of_four(rubric=yaml.safe_dump(data, sort_keys=False), report=measured)
    waiting = row(gradebook.read(folder), "s1")
    assert (waiting.state, waiting.total, waiting.max) == (State.TO_GRADE, Decimal("95.00"), Decimal("100.00"))
    assert "to be graded by a person" in waiting.comment
    folder.overrides.write_text("submissions: {team07: {points: {F4: {points: 4, why: seen in the lab, by: Ada}}}}")
    done = row(gradebook.read(folder), "s1")
    assert (done.state, done.total) == (State.GRADED, Decimal("99.00"))


def test_a_result_for_another_rubric_or_an_earlier_submission_is_no_grade(class_of_four):
    """An interrupted batch leaves them until the same command has gone on."""
    folder = class_of_four()
    facts = folder.facts()
    folder.write_facts(replace(facts, rubric="0" * 64))
    assert row(gradebook.read(folder), "s1").state is State.PENDING
    newer = tuple(replace(entry, content="c" * 64) for entry in facts.entries)
    folder.write_facts(replace(facts, entries=newer))
    assert (row(gradebook.read(folder), "s1").state, row(gradebook.read(folder), "s1").total) == (State.PENDING, None)


def test_who_may_own_an_unmatched_submission_has_not_handed_in_nothing(class_of_four):
    """Everyone whom an ambiguous submission might belong to had 0.00 in the platform."""
    folder = class_of_four(zero_missing=True)
    facts = folder.facts()
    doubt = Doubt(DoubtKind.AMBIGUOUS, "Eva Ost", "", "", "boek", facts.missing)
    for doubts, state in (((), State.MISSING), ((doubt,), State.PENDING)):
        folder.write_facts(replace(facts, doubts=doubts))
        (row,) = (row for row in gradebook.read(folder).rows if row.person.id == "s4")
        assert (row.state, row.total is None) == (state, bool(doubts))


def test_a_text_instead_of_a_package_waits_for_a_person(class_of_four):
    folder = class_of_four()
    folder.write_facts(replace(folder.facts(), doubts=(Doubt(DoubtKind.LEFT_OUT, "boek", "", "", "boek"),)))
    states = {row.submission: (row.state, row.total) for row in gradebook.read(folder).rows}
    assert states["boek"] == (State.PENDING, None)
    folder.overrides.write_text("submissions: {boek: {adjust: {total: 0, why: only a link, by: Ada}}}")
    states = {row.submission: (row.state, row.total) for row in gradebook.read(folder).rows}
    assert states["boek"] == (State.GRADED, 0)


@pytest.mark.parametrize(
    ("person", "submission", "named"),
    [("s3", "boek", ("Bo Ek", "bo@uni.edu")), ("s2", "", ("=Li Wu", "li@uni.edu")), ("s4", "", ("Eva Ost",))],
    ids=["alone", "in a team", "without a hand-in"],
)
def test_whoever_is_deleted_as_the_privacy_page_says_is_on_no_sheet_and_no_page(
    class_of_four, capsys, person: str, submission: str, named: tuple[str, ...]
):
    folder = class_of_four()
    folder.write_facts(replace(folder.facts(), roster=tuple(row.person for row in gradebook.read(folder).rows)))
    assert cli.main(["gradebook", str(folder.path)]) == 0
    assert all(word in (folder.path / "index.html").read_text() for word in named[:1])
    if submission:
        shutil.rmtree(folder.submission(submission))
    block = rf"^( *)- id: (?:{person}|{submission or person})\n(?:\1 .*\n)*"
    text = re.sub(block, "", (folder.path / CLASS).read_text(), flags=re.MULTILINE)
    (folder.path / CLASS).write_text(text)
    assert cli.main(["gradebook", str(folder.path)]) == 0
    for path in (CLASS, "gradebook.csv", "index.html"):
        assert [word for word in named if word in (folder.path / path).read_text()] == [], path
    assert "Jane Doe" in (folder.path / "gradebook.csv").read_text()
    assert len(gradebook.read(folder).rows) == 3
