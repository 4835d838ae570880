"""overrides.yaml: what people decide, and how mistakes in it are named."""

from __future__ import annotations

import datetime as dt
from decimal import Decimal
from pathlib import Path

import pytest
from helpers import beside

from grader.classroom import overrides
from grader.classroom.class_folder import ClassFacts, Doubt, DoubtKind, Entry
from grader.classroom.overrides import Adjustment, Decisions, Reason
from grader.classroom.roster import Person
from grader.errors import GraderError
from grader.scoring import rubric
from grader.scoring.grading import Decision

TEXTS = beside(__file__)

RUBRIC = rubric.load(rubric.RUBRIC)
PEOPLE = (Person("s1", "Jane Doe", login="jdoe"), Person("s2", "Li Wu"))


def load(tmp_path, text: str) -> Decisions:
    path = tmp_path / "overrides.yaml"
    path.write_text(text)
    return overrides.load(path, ["team07", "team08"], PEOPLE, RUBRIC)


def test_points_comments_times_extensions_and_excuses(tmp_path):
    found = load(tmp_path, TEXTS["GOOD"])
    decided = found.on("team07")
    assert decided.points == (Decision("F4", 3.5, "the wall stood in the start", "Ada"),)
    assert decided.comments == ("A fine README.",)
    assert decided.submitted == dt.datetime(2026, 11, 21, 10, tzinfo=dt.UTC)
    extension = found.about(PEOPLE[0]).extension
    assert extension is not None
    assert extension.until == dt.datetime(2026, 11, 25, 23, 59, tzinfo=dt.UTC)
    assert found.about(PEOPLE[1]).excused == Reason("passed last year", "Ada")
    assert found.on("team08").points == ()


def test_the_whole_is_adjusted_for_a_submission_or_a_person(tmp_path):
    found = load(tmp_path, TEXTS["ADJUSTED"])
    assert found.on("team07").adjustments == (Adjustment("points", Decimal("-2"), "a build folder", "Ada"),)
    assert found.about(PEOPLE[0]).adjustments == (Adjustment("total", Decimal("50"), "oral exam", "Ada"),)
    assert [str(each) for each in found.about(PEOPLE[1]).adjustments] == ["bonus of 3.5 points by Ada (found a fault)"]


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("points: -2", "points: lots", r"line 3: lots is not a number of points"),
        ("points: -2, ", "", r"line 3: adjust needs points or total, why, by"),
        ("points: -2", "points: -2, total: 3", r"line 3: adjust needs points or total, why, by"),
        ("total: 50", "total: 101", r"line 6: the rubric has 100 points; 101 is outside 0 to 100"),
        ("points: 3.5", "points: -1", r"line 8: a bonus of -1 points is none; `adjust` subtracts points"),
        ("points: 3.5", "total: 3", r"line 8: bonus needs points, why, by"),
        (", by: Ada}\npeople", "}\npeople", r"line 3: 'by' is missing"),
    ],
)
def test_a_mistake_in_an_adjustment_is_named_with_its_line(tmp_path, old, new, said):
    assert old in TEXTS["ADJUSTED"]
    with pytest.raises(GraderError, match=said):
        load(tmp_path, TEXTS["ADJUSTED"].replace(old, new, 1))


def test_a_name_that_two_people_have_decides_about_neither(tmp_path):
    path = tmp_path / "overrides.yaml"
    path.write_text("people:\n  Li Wu:\n    excused: {why: ill, by: Ada}\n")
    with pytest.raises(
        GraderError, match=r"line 2: Li Wu is 2 people of this class; write s2 \(id\) or 4711 \(lms_id\)"
    ):
        overrides.load(path, [], (*PEOPLE, Person(name="Li Wu", lms_id="4711")), RUBRIC)


@pytest.mark.parametrize("text", ["", "submissions:\n", "submissions: {}\npeople:\n"])
def test_an_empty_file_decides_nothing(tmp_path, text):
    assert load(tmp_path, text) == Decisions()


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("team07", "taem07", r"line 2: taem07 is not a submission of this class. Did you mean team07\?"),
        ("F4:", "F44:", r"line 4: F44 is not a requirement of the rubric. Did you mean F"),
        ("3.5", "5.5", r"line 4: F4 has 5 points; 5.5 is outside 0 to 5"),
        ("3.5", ".nan", r"line 4: .*nan"),
        ("3.5", "many", r"line 4: many is not a number of points"),
        (", by: Ada}\n    comments", "}\n    comments", r"line 4: 'by' is missing; a decision needs points, why, by"),
        ("comments", "coments", r"line 5: coments is not allowed here. Did you mean comments\?"),
        ("2026-11-21T10:00+00:00", "yesterday", r"line 6: yesterday is not a time"),
        ("jdoe", "jdo", r"line 8: jdo is not a person of this class. Did you mean jdoe\?"),
        ("people:", "submissions:", r"line 7: submissions is written twice"),
        ("{points: 3.5", "[points: 3.5", r"line 4: "),
        ("  team07:", "- team07", r"line \d+: "),
    ],
)
def test_a_mistake_is_named_with_its_line_and_a_remedy(tmp_path, old, new, said):
    assert old in TEXTS["GOOD"]
    with pytest.raises(GraderError, match=said):
        load(tmp_path, TEXTS["GOOD"].replace(old, new, 1))


def test_people_assign_a_submission_and_take_one_back(tmp_path):
    stranger, wrong = Entry("stranger", "x", Path("x.zip"), "x"), Entry("jdoe", "y", Path("y.zip"), "y", PEOPLE[:1])
    doubts = tuple(Doubt(DoubtKind.UNMATCHED, "x", "", "", name) for name in ("stranger", "other"))
    facts = ClassFacts("", "", "", "", "", "", "", 0, (stranger, wrong), PEOPLE[1:], doubts=doubts)
    path = tmp_path / "overrides.yaml"
    path.write_text("submissions:\n  stranger: {people: [S1]}\n  jdoe: {people: []}\n")
    decided = overrides.load(path, ["stranger", "jdoe"], PEOPLE, RUBRIC)
    found = overrides.applied(facts, decided)
    assert [entry.people for entry in found.entries] == [PEOPLE[:1], ()]
    assert found.missing == PEOPLE[1:]
    assert [doubt.entry for doubt in found.doubts] == ["other"]
