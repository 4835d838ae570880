"""A term: totals of several classes, matched by the rules of identity, with every doubt listed."""

from __future__ import annotations

import csv
import hashlib
import json
from dataclasses import replace
from decimal import Decimal
from pathlib import Path

import pytest
from helpers.class_reports import report

from grader import cli
from grader.classroom import term
from grader.classroom.class_folder import RUBRIC, ClassFacts, ClassFolder, Record, Status
from grader.classroom.entry import Entry
from grader.classroom.roster import Person
from grader.errors import GraderError
from grader.scoring import rubric

TEXT = rubric.RUBRIC.read_text()
HASH = hashlib.sha256(TEXT.encode()).hexdigest()


def sheet(folder: Path, *people: tuple[Person, float], missing: tuple[Person, ...] = (), overrides: str = "") -> None:
    """Make a class in which each person lost so many points of F8, or is not graded with NaN."""
    made, entries = ClassFolder(folder), []
    folder.mkdir(parents=True)
    (folder / RUBRIC).write_text(TEXT)
    for number, (person, lost) in enumerate(people):
        name = f"s{number}"
        entries.append(Entry(name, name, Path(f"{name}.zip"), str(number) * 64, (person,)))
        if lost == lost:
            results = made.working(name)
            (results / "report.json").write_text(json.dumps(report({"F8": lost})))
            made.keep(results, Record(name, Status.GRADED, "", str(number) * 64, HASH))
    made.write_facts(ClassFacts("Robots", "x", "plain", HASH, "k", "0", "", 0, tuple(entries), missing))
    (folder / "overrides.yaml").write_text(overrides)


def written(folder: Path, text: str) -> term.Term:
    (folder / "term.yaml").write_text(text)
    return term.read(folder)


TWO = "sheets:\n  - {class: one, weight: 20}\n  - {class: two, weight: 30, title: Driving}\n"
JANE, LI = Person("s1", "Jane Doe", "jane@uni.edu"), Person(name="李 小龍", email="li@uni.edu")


def test_each_person_has_one_total_by_the_weights(tmp_path):
    sheet(tmp_path / "one", (JANE, 0), (LI, 5))
    sheet(tmp_path / "two", (Person(name="李 小龍", email="LI@uni.edu"), 6), (replace(JANE, email=""), 0))
    found = term.add_up(written(tmp_path, TWO))
    totals = {line.person.label: (line.points, line.total) for line in found.lines}
    assert totals["Jane Doe"] == ({"one": Decimal("20.00"), "Driving": Decimal("30.00")}, Decimal("50.00"))
    assert totals["李 小龍"] == ({"one": Decimal("19.00"), "Driving": Decimal("28.20")}, Decimal("47.20"))
    assert found.doubts == ()
    assert len(found.lines) == 2


def test_the_command_writes_a_table(tmp_path, capsys):
    sheet(tmp_path / "one", (replace(JANE, name="=Jane"), 0))
    sheet(tmp_path / "two", (replace(JANE, name="=Jane"), 3))
    (tmp_path / "term.yaml").write_text(TWO)
    assert cli.main(["term", str(tmp_path)]) == 0
    header, line = csv.reader((tmp_path / "totals.csv").read_text().splitlines())
    assert header == ["id", "name", "email", "login", "one (20)", "Driving (30)", "total", "max", "remarks"]
    assert line == ["s1", "'=Jane", "jane@uni.edu", "", "20.00", "29.10", "49.10", "50.00", ""]
    assert "1 person, 1 with a total of at most 50.00; 0 doubts" in capsys.readouterr().out


def test_two_of_one_name_are_never_added_to_each_other(tmp_path):
    """Each has an id in one class, and the other class has the name alone."""
    sheet(tmp_path / "one", (Person("s1", "Jane Doe"), 0), (Person("s2", "Jane Doe"), 5))
    sheet(tmp_path / "two", (Person(name="Jane Doe"), 0))
    found = term.add_up(written(tmp_path, TWO))
    assert [line.total for line in found.lines] == [None, None, None]
    assert "Driving: Jane Doe may be Jane Doe (id s1) or Jane Doe (id s2)" in found.doubts[0]


def test_a_number_of_moodle_means_nothing_in_another_class(tmp_path):
    """Moodle numbers participants anew for each assignment: 101 is somebody else there."""
    sheet(tmp_path / "one", (Person(name="Jane Doe", lms_id="101", lms="moodle"), 0))
    sheet(tmp_path / "two", (Person(name="Li Wu", lms_id="101", lms="moodle"), 6))
    found = term.add_up(written(tmp_path, TWO))
    assert [(line.person.name, line.total) for line in found.lines] == [
        ("Jane Doe", Decimal("20.00")),
        ("Li Wu", Decimal("28.20")),
    ]


def test_whoever_is_not_in_the_roster_is_listed_and_not_counted(tmp_path):
    (tmp_path / "roster.csv").write_text("id,name\ns1,Jane Doe\ns9,Eva Ost\n")
    sheet(tmp_path / "one", (JANE, 0), (Person(name="Bo Ek"), 0))
    sheet(tmp_path / "two", (JANE, 0))
    found = term.add_up(written(tmp_path, "roster: roster.csv\n" + TWO))
    assert "one: Bo Ek is not in the roster." in found.doubts
    totals = {line.person.label: line.total for line in found.lines}
    assert totals == {"Jane Doe": Decimal("50.00"), "Eva Ost": Decimal("0.00"), "Bo Ek": None}


def test_what_is_not_graded_yet_leaves_the_total_open_and_what_is_excused_does_not_count(tmp_path):
    excused = "people: {s1: {excused: {why: ill, by: A. Lee}}}\n"
    sheet(tmp_path / "one", (JANE, 0), (LI, 0), overrides=excused)
    sheet(tmp_path / "two", (JANE, 6), (LI, float("nan")))
    found = {line.person.label: line for line in term.add_up(written(tmp_path, TWO)).lines}
    jane, li = found["Jane Doe"], found[LI.name]
    assert (jane.points["one"], jane.total) == (
        None,
        Decimal("47.00"),
    )  # all of the term's points are those of the other sheet
    assert li.total is None
    assert "Driving is not graded yet" in li.remarks


def test_the_term_can_be_moved(tmp_path):
    sheet(tmp_path / "term" / "one", (JANE, 0))
    sheet(tmp_path / "term" / "two", (JANE, 0))
    written(tmp_path / "term", TWO)
    (tmp_path / "term").rename(tmp_path / "archive")
    assert term.add_up(term.read(tmp_path / "archive")).lines[0].total == Decimal("50.00")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("sheets:\n  - {class: one}\n", "line 2: 'weight' is missing"),
        ("sheets:\n  - {class: gone, weight: 2}\n", "line 2: .*gone is not a class"),
        ("sheets:\n  - {class: one, weight: .nan}\n", "line 2: .nan is not a weight"),
        ("sheets:\n  - {class: one, weight: 1}\n  - {class: one, weight: 1}\n", "line 3: two sheets are called one"),
        ("", r"is empty. Write it like this:\nsheets:\n  - {class: one, weight: 100}"),
    ],
)
def test_a_mistake_in_term_yaml_is_named_with_its_line(tmp_path, text: str, words: str):
    sheet(tmp_path / "one", (JANE, 0))
    with pytest.raises(GraderError, match=words):
        written(tmp_path, text)
