"""A class without names: nothing that is written, down to the names of files, names a person, but the key."""

from __future__ import annotations

import csv
import html
import re
from dataclasses import replace
from pathlib import Path

import pytest
from helpers import recordings
from helpers.class_reports import judge

from grader import cli
from grader.classroom import naming
from grader.classroom.class_folder import RUBRIC, ClassFacts, ClassFolder, Record, Status
from grader.classroom.doubt import Doubt, DoubtKind
from grader.classroom.entry import Entry
from grader.classroom.roster import Person
from grader.evidence import Flag
from grader.scoring import rubric
from grader.scoring.grading import HandIn

pytestmark = pytest.mark.slow  # each writes a class of ten twice, with their reports

SEAN = Person("s1230", "Seán O'Brien", "sean.obrien@uni.example", "sobrien", "team-alpha", "44120", "moodle")
LI = Person("s1231", "李 小龍", "li.xiaolong@uni.example", "xlong", "team-alpha")
ADA = Person("s1234", "Ada Müller-Vogt", "ada.mv@uni.example", "adamv")
BO = Person("s1235", "Bo Ekdahl", "bo@uni.example", "bekdahl")
EVERYONE = (SEAN, LI, ADA, BO)
OVERRIDES = """\
submissions:
  adamv: {points: {F4: {points: 1, why: "as Ada Müller-Vogt asked", by: "A. Lovelace"}}, comments: ["Dear Ada!"]}
people:
  s1231: {excused: {why: "xlong was ill", by: "A. Lovelace"}}
"""


@pytest.fixture
def named(tmp_path: Path) -> ClassFolder:
    """Return a class whose students wrote their names wherever they could, one with a report that has all of them."""
    folder = ClassFolder(tmp_path / "class")
    folder.path.mkdir()
    (folder.path / RUBRIC).write_text(rubric.RUBRIC.read_text())
    entries = (
        Entry("adamv", "mullervogtada", Path("mullervogtada_7_8_x.zip"), "a" * 64, (ADA,), number="7712345"),
        Entry("team-alpha", "Seán O'Brien", Path("Seán O'Brien_44120_file/x.zip"), "b" * 64, (SEAN, LI)),
        Entry("eve-stranger", "Eve Stranger", Path("Eve Stranger.zip"), "c" * 64),
    )
    doubt = Doubt(DoubtKind.UNMATCHED, "Eve Stranger", "Eve Stranger fits nobody.", "Add her.", "eve-stranger")
    hash_ = rubric.load(rubric.RUBRIC).sha256
    facts = ClassFacts(
        "Robots", "/home/sobrien/export.zip", "moodle", hash_, "k", "0", "", 0, entries, (BO,), ("Ada.txt is odd.",),
        doubts=(doubt,), roster=EVERYONE,
    )  # fmt: skip
    folder.write_facts(facts)
    flag = Flag("network", "asked Adamv.example for s1234", where="/ws/Ada_Müller-Vogt/x.py")
    found = recordings.load("does_not_compile")
    notes = [
        "by Seán O'Brien <sean.obrien@uni.example>",
        "and Müller-Vogt, Ada of Ada Müller-Vogt",
        "obrien, LI.XIAOLONG@uni.example",
    ]
    found = replace(
        found, flags=[flag], origin=found.origin | {"source": "/in/Seán O'Brien_44120_file"},
        intake=replace(found.intake, name="Seán O'Brien_44120_file", notes=notes, others=["sobrien/old"]),
    )  # fmt: skip
    for entry in entries:
        made = folder.working(entry.id)
        graded = entry.id != "eve-stranger"
        if graded:
            judge(found, made, HandIn(tuple(person.name for person in entry.people), "team-alpha"))
        status, why = (Status.GRADED, "") if graded else (Status.REFUSED, "Eve Stranger.zip is empty.")
        folder.keep(made, Record(entry.id, status, why, entry.content, hash_))
    folder.overrides.write_text(OVERRIDES)
    (folder.path / "similar.json").write_text(
        '{"usual": 0.1, "pairs": [{"one": "adamv", "other": "team-alpha", "share": 0.9}]}'
    )
    return folder


def said_of(person: Person) -> list[str]:
    return [value for value in (person.id, person.name, person.email, person.login, person.lms_id) if value]


def test_nothing_that_is_written_names_a_person(named: ClassFolder, capsys):
    """Only gradebook.csv was without names: reports, pages and the names of folders still had them."""
    assert cli.main(["gradebook", str(named.path)]) == 0
    before = (named.path / "gradebook.csv").read_bytes()
    assert cli.main(["gradebook", str(named.path), "--anonymous"]) == 0
    out = named.path / "anonymous"
    files = [path for path in sorted(out.rglob("*")) if path.is_file()]
    names = {path.relative_to(out).as_posix() for path in files}
    assert {"gradebook.csv", "index.html", "sections.html", "submissions/hand-in-001/report.html"} <= names
    assert len([name for name in names if name.endswith("report.json")]) == 2
    words = [word for person in EVERYONE for word in said_of(person)]
    words += [
        "Eve Stranger",
        "eve-stranger",
        "adamv",
        "team-alpha",
        "mullervogtada",
        "7712345",
        "O'Brien",
        "Müller-Vogt",
    ]
    for path in files:
        text = html.unescape(path.read_bytes().decode()).casefold()
        spelt = text.encode().decode("unicode_escape", errors="ignore") if path.suffix == ".json" else ""
        for word in words:
            assert word.casefold() not in text, f"{path.name} has {word}"
            assert word.casefold() not in spelt.casefold(), f"{path.name} has {word}"
            assert word.casefold() not in path.relative_to(out).as_posix().casefold()
    assert (named.path / "gradebook.csv").read_bytes() == before, "the one with names was overwritten"
    for page in out.glob("submissions/*/report.html"):  # the title was the name of a file
        title = re.search(r"<title>(.*)</title>", page.read_text())[1]
        assert re.search(r" · person-\d{3}(, person-\d{3})?( · |$)", title), title
        assert f'"submission": "{page.parent.name}"' in (page.parent / "report.json").read_text()
    assert "still has" not in capsys.readouterr().out


def table(path: Path) -> dict[str, dict[str, str]]:
    return {line["id"]: line for line in csv.DictReader(path.read_text().splitlines())}


def test_the_copy_says_the_same_as_the_class_and_the_key_says_who_is_who(named: ClassFolder):
    assert cli.main(["gradebook", str(named.path)]) == 0
    assert cli.main(["gradebook", str(named.path), "--anonymous"]) == 0
    key = table(named.path / "anonymous_key.csv")
    assert set(key) >= {person.id for person in EVERYONE}
    ada, copy = key["s1234"], table(named.path / "anonymous" / "gradebook.csv")
    assert (copy[ada["anonymous"]]["submission"], copy[ada["anonymous"]]["F4"]) == (ada["hand-in"], "1.00")
    for name, line in table(named.path / "gradebook.csv").items():
        if name:
            assert line["total"] == copy[key[name]["anonymous"]]["total"]
    page = (named.path / "anonymous" / "index.html").read_text()
    assert f'href="submissions/{ada["hand-in"]}/report.html"' in page
    report = (named.path / "anonymous" / "submissions" / ada["hand-in"] / "report.html").read_text()
    assert ada["anonymous"] in report
    assert re.search(r"by person-\d+ |by hand-in-\d+ ", report), "what a student wrote stays but for the names"


def test_a_folder_of_something_else_is_not_overwritten(named: ClassFolder, tmp_path, capsys):
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.tex").touch()
    assert cli.main(["gradebook", str(named.path), "--anonymous", "--out", str(tmp_path / "mine")]) == 2
    assert (tmp_path / "mine" / "thesis.tex").exists()
    assert "is not an anonymous class" in capsys.readouterr().err


@pytest.mark.slow  # grades a class of its own
def test_a_login_that_is_the_name_without_its_space_breaks_no_link(named: ClassFolder, monkeypatch: pytest.MonkeyPatch):
    """Of "boekdahl" and "BoEkdahl" one won by chance, and links went to a person's alias instead of a hand-in's."""
    person = replace(BO, login="boekdahl")
    facts = named.facts()
    entry = Entry("boekdahl", "Bo Ekdahl", Path("Bo Ekdahl.zip"), "d" * 64, (person,))
    roster = tuple(person if each == BO else each for each in facts.roster)
    named.write_facts(replace(facts, entries=(*facts.entries, entry), missing=(), roster=roster))
    made = named.working(entry.id)
    judge(recordings.load("does_not_compile"), made, HandIn((person.name,), ""))
    named.keep(made, Record(entry.id, Status.GRADED, "", entry.content, facts.rubric))
    monkeypatch.setattr("grader.classroom.naming.words", lambda of, usual=naming.words: sorted(usual(of), reverse=True))
    assert cli.main(["gradebook", str(named.path), "--anonymous"]) == 0
    page = (named.path / "anonymous" / "index.html").read_text()
    own = table(named.path / "anonymous_key.csv")["s1235"]["hand-in"]
    assert f'href="submissions/{own}/report.html"' in page
    assert 'href="submissions/person-' not in page
