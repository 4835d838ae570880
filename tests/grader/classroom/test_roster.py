"""Reading a roster: ours, and the exports of Canvas and Moodle."""

from __future__ import annotations

import datetime as dt

import pytest

from grader.classroom import roster, times
from grader.classroom.roster import Person
from grader.errors import GraderError


def people(tmp_path, text: str, encoding: str = "utf-8") -> tuple[Person, ...]:
    path = tmp_path / "roster.csv"
    path.write_text(text, encoding=encoding)
    return roster.load(path)


@pytest.mark.parametrize(
    ("text", "encoding", "found"),
    [
        (
            "id,name,email,login,team\n1,Jane Doe,jane@uni.edu,jdoe,team07\n\n2,Li Wu,li@uni.edu,liwu,\n",
            "utf-8",
            (Person("1", "Jane Doe", "jane@uni.edu", "jdoe", "team07"), Person("2", "Li Wu", "li@uni.edu", "liwu")),
        ),
        (
            "ID;Name;E-Mail\n1;Müller, Jörg;j@uni.edu\n",
            "utf-8-sig",
            (Person("1", "Jörg Müller", "j@uni.edu", sortable="Müller, Jörg"),),
        ),
        (
            "Student,ID,SIS User ID,SIS Login ID,Section,Robots (77)\n    Points Possible,,,,,100\n"
            '"Doe, Jane",12345,s1,jdoe,A,\n',
            "utf-8",
            (Person("s1", "Jane Doe", login="jdoe", lms_id="12345", lms="canvas", sortable="Doe, Jane"),),
        ),
        (
            'Identifier,"Full name","ID number","Email address",Status,Grade\n"Participant 12345",Jane Doe,s1,j@x,,\n',
            "utf-8",
            (Person("s1", "Jane Doe", "j@x", lms_id="12345", lms="moodle"),),
        ),
        (
            "First name,Surname,Username\nJane,Doe,jd\n",
            "utf-8",
            (Person(name="Jane Doe", login="jd", sortable="Doe, Jane"),),
        ),
    ],
    ids=["our own columns", "a spreadsheet's", "Canvas's gradebook", "Moodle's worksheet", "first and last names"],
)
def test_a_roster_is_read(tmp_path, text, encoding, found):
    assert people(tmp_path, text, encoding) == found


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            "id,email\n1,jane@uni.edu\n2,li@uni.edu\n3,Jane@uni.edu\n",
            r"line 4: the email jane@uni\.edu is in line 2 too",
        ),
        ("name,team\nLi Wu,a\nLi Wu,b\n", r"line 3: the name li wu is in line 2 too.* tells people of one name apart"),
        ("color,size\nred,1\n", "no column that names a person"),
    ],
)
def test_what_is_no_roster_is_refused(tmp_path, text, said):
    with pytest.raises(GraderError, match=said):
        people(tmp_path, text)


def test_a_roster_that_cannot_be_read_is_a_sentence(tmp_path):
    with pytest.raises(GraderError, match="cannot be read"):
        roster.load(tmp_path / "missing.csv")


def test_a_suffix_behind_a_comma_is_no_first_name(tmp_path):
    """`John;Smith, Jr.` became "Jr. John Smith"."""
    in_two = people(tmp_path, "id;First name;Last name\n1;John;Smith, Jr.\n")
    in_one = people(tmp_path, 'id,name\n1,"Smith, John, Jr."\n2,"Doe, Jane"\n3,"Bo Ek, Jr."\n')
    assert [who.name for who in (*in_two, *in_one)] == [
        "John Smith, Jr.",
        "John Smith Jr.",
        "Jane Doe",
        "Bo Ek, Jr.",
    ]


GERMAN = (
    'ID;"Vollst\u00e4ndiger Name";E-Mail-Adresse;Status;Bewertung;Bestwertung;"Bewertung kann ge\u00e4ndert werden";'
    '"Zuletzt ge\u00e4ndert (Abgabe)";"Zuletzt ge\u00e4ndert (Bewertung)"\n'
    'Teilnehmer/in12345;Jane Doe;j@x;;;100,00;Ja;"Freitag, 20. November 2026, 23:59";-\n'
    "Teilnehmer/in12346;Bo Ek;b@x;;;100,00;Ja;-;-\n"
)


def test_a_german_worksheet_is_a_roster_with_times(tmp_path):
    """Its column ID was read as the students' own, and its times were not read at all."""
    found = people(tmp_path, GERMAN, "utf-8-sig")
    assert found[0] == Person(name="Jane Doe", email="j@x", lms_id="12345", lms="moodle")
    (time,) = times.load(tmp_path / "roster.csv")
    assert time.when == dt.datetime(2026, 11, 20, 23, 59).astimezone()


@pytest.mark.parametrize(
    ("text", "hour"),
    [
        ("Friday, 20 November 2026, 11:59 PM", 23),
        ("Friday, 20 November 2026, 12:05 AM", 0),
        ("Freitag, 20. November 2026, 23:59", 23),
    ],
)
def test_a_time_is_read_in_moodles_languages(text, hour):
    found = roster.worksheet_time(text)
    assert found is not None
    assert (found.year, found.month, found.day, found.hour) == (2026, 11, 20, hour)


@pytest.mark.parametrize("text", ["-", "20 novembre 2026, 10:00", "20/11/2026 10:00", "yesterday"])
def test_a_time_that_is_not_sure_is_not_guessed(text):
    assert roster.worksheet_time(text) is None
