"""Reading a roster: ours, and the exports of Canvas and Moodle."""

from __future__ import annotations

import pytest

from grader.classroom import roster
from grader.classroom.roster import Person
from grader.errors import GraderError


def people(tmp_path, text: str, encoding: str = "utf-8") -> tuple[Person, ...]:
    path = tmp_path / "roster.csv"
    path.write_text(text, encoding=encoding)
    return roster.load(path)


def test_our_own_columns(tmp_path):
    found = people(
        tmp_path, "id,name,email,login,team\n1,Jane Doe,jane@uni.edu,jdoe,team07\n\n2,Li Wu,li@uni.edu,liwu,\n"
    )
    assert found == (
        Person("1", "Jane Doe", "jane@uni.edu", "jdoe", "team07"),
        Person("2", "Li Wu", "li@uni.edu", "liwu"),
    )


def test_a_spreadsheets_semicolons_and_byte_order_mark(tmp_path):
    found = people(tmp_path, "ID;Name;E-Mail\n1;Müller, Jörg;j@uni.edu\n", "utf-8-sig")
    assert found == (Person("1", "Jörg Müller", "j@uni.edu", sortable="Müller, Jörg"),)


def test_canvas_gradebook_is_a_roster(tmp_path):
    found = people(
        tmp_path,
        "Student,ID,SIS User ID,SIS Login ID,Section,Robots (77)\n"
        "    Points Possible,,,,,100\n"
        '"Doe, Jane",12345,s1,jdoe,A,\n',
    )
    assert found == (Person("s1", "Jane Doe", login="jdoe", lms_id="12345", lms="canvas", sortable="Doe, Jane"),)


def test_moodle_grading_worksheet_is_a_roster(tmp_path):
    found = people(
        tmp_path,
        'Identifier,"Full name","ID number","Email address",Status,Grade\n"Participant 12345",Jane Doe,s1,j@x,,\n',
    )
    assert found == (Person("s1", "Jane Doe", "j@x", lms_id="12345", lms="moodle"),)


def test_first_and_last_names_are_joined(tmp_path):
    assert people(tmp_path, "First name,Surname,Username\nJane,Doe,jd\n")[0].name == "Jane Doe"


def test_somebody_listed_twice_is_refused_with_both_lines(tmp_path):
    with pytest.raises(GraderError, match=r"line 4: the email jane@uni\.edu is in line 2 too"):
        people(tmp_path, "id,email\n1,jane@uni.edu\n2,li@uni.edu\n3,Jane@uni.edu\n")


def test_two_of_one_name_that_nothing_tells_apart_are_refused(tmp_path):
    with pytest.raises(GraderError, match=r"line 3: the name li wu is in line 2 too.* tells people of one name apart"):
        people(tmp_path, "name,team\nLi Wu,a\nLi Wu,b\n")


def test_a_roster_without_usable_columns_is_refused(tmp_path):
    with pytest.raises(GraderError, match="no column that names a person"):
        people(tmp_path, "color,size\nred,1\n")


def test_a_roster_that_cannot_be_read_is_a_sentence(tmp_path):
    with pytest.raises(GraderError, match="cannot be read"):
        roster.load(tmp_path / "missing.csv")
