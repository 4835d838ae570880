"""What learning platforms import, read back by the rules of their own importers."""

from __future__ import annotations

import base64
import csv
import io
import json
import re
from dataclasses import replace
from decimal import Decimal
from pathlib import Path

import pytest
from helpers.class_reports import report

from grader.classroom import cells, gradebook
from grader.classroom.platforms import canvas, github, gradescope, moodle, plain
from grader.errors import GraderError

EXCUSED = "people: {s4: {excused: {why: ill, by: Ada}}}"


def rows(path: Path) -> list[list[str]]:
    return list(csv.reader(io.StringIO(path.read_text())))


@pytest.fixture
def book(class_of_four):
    return gradebook.read(class_of_four(EXCUSED))


@pytest.mark.parametrize("start", ["=", "+", "-", "@", "\t", "\r", "＝"])
def test_a_cell_never_begins_like_a_formula(start):
    assert cells.neutral(f"{start}cmd|' /C calc'!A0").startswith("'")


@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_no_cell_ends_at_another_countrys_separator(tmp_path, separator):
    """A name `Ann;=1+2` was two cells where spreadsheets separate by semicolons, and the second a formula."""
    row = ["Ann;=1+2", "a,b", "c\td", 'say "x"', "two\nlines", "plain"]
    cells.write_as_read(tmp_path / "a.csv", [row], separator)
    text = (tmp_path / "a.csv").read_text()
    assert list(csv.reader(io.StringIO(text, newline=""), delimiter=separator)) == [row]
    assert re.sub(r'"(?:[^"]|"")*"', "", text) == separator * 5 + "plain\n"


def test_a_negative_number_stays_a_number():
    assert cells.neutral(Decimal("-1.50")) == "-1.50"


def test_the_table_has_a_line_for_each_person_and_a_column_for_each_requirement(book, tmp_path):
    plain.write(book, tmp_path / "book.csv")
    header, *lines = rows(tmp_path / "book.csv")
    by_id = {line[0]: dict(zip(header, line, strict=True)) for line in lines}
    assert (by_id["s1"]["F4"], by_id["s1"]["total"], by_id["s1"]["team"]) == ("3.00", "98.00", "team07")
    assert by_id["s2"]["name"] == "'=Li Wu"
    assert (by_id["s4"]["state"], by_id["s4"]["total"]) == ("excused", "")
    assert {"F14", "I8", "Q6", "T3"} <= set(header)
    requirements = [by_id["s1"][r.id] for r in book.rubric.requirements]
    assert sum(map(Decimal, requirements)) == Decimal(by_id["s1"]["total"])


def test_the_anonymous_table_has_its_names_in_a_file_of_its_own(book, tmp_path):
    plain.write(book, tmp_path / "book.csv", key=tmp_path / "key.csv")
    text = (tmp_path / "book.csv").read_text()
    assert not re.search(r"Jane|jdoe|s1|team07|uni\.edu", text)
    header, *lines = rows(tmp_path / "key.csv")
    key = {line[0]: dict(zip(header, line, strict=True)) for line in lines}
    assert {"s1", "s2", "s3", "s4"} == {person["id"] for person in key.values()}
    assert {line[0] for line in rows(tmp_path / "book.csv")[1:]} == set(key)


def canvas_import(path: Path) -> tuple[str, str, dict[str, str]]:
    """Read a file as Canvas's GradebookImporter does; return the assignment, its number, and scores by student."""
    header, *lines = rows(path)
    assert "Student" in header[0]
    assert "ID" in header[1]
    section = max(index for index, name in enumerate(header) if "Section" in name)
    assert section < len(header) - 1, "the last column about a student names the section; assignments come after it"
    found = re.fullmatch(r"(.*)\s\((\d+)\)", header[section + 1])
    assert found
    scores = {line[1]: line[section + 1] for line in lines if "Points Possible" not in line[0]}
    return found[1], found[2], scores


def numbered_by(platform: str, book: gradebook.Gradebook) -> gradebook.Gradebook:
    return replace(book, rows=tuple(replace(row, person=replace(row.person, lms=platform)) for row in book.rows))


def test_a_participants_number_of_moodle_is_no_number_of_canvas(book, tmp_path):
    """It was written into the column ID, by which Canvas looks first: that of another person."""
    canvas.write(numbered_by("moodle", book), tmp_path / "canvas.csv", "Robots (77)")
    assert {line[1] for line in rows(tmp_path / "canvas.csv")[1:]} == {""}
    (tmp_path / "export.csv").write_text(CANVAS_EXPORT.replace("99999,,", "12346,,"))
    unknown = canvas.fill(numbered_by("moodle", book), tmp_path / "export.csv", tmp_path / "import.csv", "Robots")
    assert unknown == ["Nobody, Known"]


def test_canvas_imports_the_grades(book, tmp_path):
    canvas.write(numbered_by("canvas", book), tmp_path / "canvas.csv", "Robots (77)")
    title, number, scores = canvas_import(tmp_path / "canvas.csv")
    assert (title, number) == ("Robots", "77")
    assert scores == {"12345": "98.00", "12346": "98.00", "12347": "0.00", "12348": "EX"}
    assert rows(tmp_path / "canvas.csv")[1][0] == "    Points Possible"


CANVAS_EXPORT = (
    "Student,ID,SIS User ID,SIS Login ID,Section,Quiz (70),Robots (77),Current Score\n"
    "    Points Possible,,,,,10,100,(read only)\n"
    '"Doe, Jane",12345,s1,jdoe,A,9,,90\n'
    '"Ek, Bo",,s3,boek,A,8,55,80\n'
    '"Nobody, Known",99999,,,B,7,44,70\n'
    '"Student, Test",88888,,,A,,,\n'
)


def test_a_gradebook_that_canvas_exported_is_filled_in(book, tmp_path):
    (tmp_path / "export.csv").write_text(CANVAS_EXPORT)
    unknown = canvas.fill(book, tmp_path / "export.csv", tmp_path / "import.csv", "Robots")
    before, after = list(csv.reader(io.StringIO(CANVAS_EXPORT))), rows(tmp_path / "import.csv")
    assert unknown == ["Nobody, Known"]
    assert [line[6] for line in after] == ["Robots (77)", "100", "98.00", "0.00", "44", ""]
    assert [line[:6] + line[7:] for line in after] == [line[:6] + line[7:] for line in before], "nothing else changes"


def test_the_assignment_has_to_be_named_where_several_could_be_meant(book, tmp_path):
    (tmp_path / "export.csv").write_text(CANVAS_EXPORT)
    with pytest.raises(GraderError, match=r"--assignment; the sheet has: Quiz \(70\), Robots \(77\)"):
        canvas.fill(book, tmp_path / "export.csv", tmp_path / "import.csv")


def test_other_points_possible_are_refused(book, tmp_path):
    (tmp_path / "export.csv").write_text(CANVAS_EXPORT.replace(",10,100,", ",10,50,"))
    with pytest.raises(GraderError, match=r"has 50 points in Canvas, the rubric 100"):
        canvas.fill(book, tmp_path / "export.csv", tmp_path / "import.csv", "Robots (77)")


def test_moodle_imports_the_grades(book, tmp_path):
    moodle.write(book, tmp_path / "moodle.csv", "Robots")
    header, *lines = rows(tmp_path / "moodle.csv")
    assert all(len(line) == len(header) for line in lines), "else Moodle refuses the file: csvweirdcolumns"
    grades = {line[header.index("idnumber")]: line[header.index("Robots")] for line in lines}
    assert all(grade == "" or 0 <= float(grade) <= 100 for grade in grades.values()), "or the import is aborted"
    assert (grades["s1"], grades["s4"]) == ("98.00", "")


def test_a_grading_worksheet_of_moodle_is_filled_in(book, tmp_path):
    sheet = (
        "Identifier,Full name,Email address,Status,Grade,Maximum Grade,Last modified (grade),Feedback comments\n"
        "Participant 12345,Jane Doe,jane@uni.edu,Submitted,,100.00,-,\n"
        "Participant 777,Bo Ek,bo@uni.edu,Submitted,,100.00,-,\n"
        "Participant 778,Nobody,n@x,No submission,,100.00,-,\n"
    )
    (tmp_path / "sheet.csv").write_text(sheet)
    unknown = moodle.fill(book, tmp_path / "sheet.csv", tmp_path / "filled.csv")
    after = rows(tmp_path / "filled.csv")
    assert unknown == ["Nobody"]
    assert [line[4] for line in after] == ["Grade", "98.00", "0.00", ""]
    assert "is empty" in after[2][7]
    assert [line[6] for line in after[1:]] == ["-"] * 3, "a cell of Moodle's own stays as it is"
    (tmp_path / "sheet.csv").write_text(sheet.replace("100.00", "10"))
    with pytest.raises(GraderError, match="maximum grade in Moodle is 10"):
        moodle.fill(book, tmp_path / "sheet.csv", tmp_path / "filled.csv")


def test_a_sheet_of_another_kind_is_refused(book, tmp_path):
    (tmp_path / "sheet.csv").write_text("a,b\n1,2\n")
    for fill, said in ((canvas.fill, "not a gradebook of Canvas"), (moodle.fill, "not an offline grading worksheet")):
        with pytest.raises(GraderError, match=said):
            fill(book, tmp_path / "sheet.csv", tmp_path / "out.csv")


def test_gradescope_reads_results_json(book, tmp_path):
    """The fields and types of gradescope/autograder_samples, docs/specs.md."""
    written = gradescope.write_all(book, {"team07": report({"F4": 2.0})}, tmp_path)
    (path,) = (path for path in written if path.parent.name == "team07")
    found = json.loads(path.read_text())
    assert set(found) <= {
        "score", "execution_time", "output", "output_format", "test_output_format", "test_name_format", "visibility",
        "stdout_visibility", "extra_data", "tests", "leaderboard",
    }  # fmt: skip
    assert found["score"] == 98.0
    assert sum(test["score"] for test in found["tests"]) == pytest.approx(98.0)
    for test in found["tests"]:
        assert isinstance(test["number"], str)
        assert test["status"] in ("passed", "failed")
        assert 0 <= test["score"] <= test["max_score"]
    (f4,) = (test for test in found["tests"] if test["name"].startswith("F4"))
    assert (f4["score"], f4["status"], f4["number"]) == (3.0, "failed", "1.4")
    assert "touched it at 7.3 s" in f4["output"]


def test_a_single_grading_becomes_results_json_too(tmp_path):
    from grader.scoring import rubric

    book = gradebook.of_one(report({"F4": 2.0}), rubric.load(rubric.RUBRIC))
    (path,) = gradescope.write_all(book, {"team07.zip": report({"F4": 2.0})}, tmp_path)
    assert json.loads(path.read_text())["score"] == 98.0


def test_github_gets_annotations_that_a_submission_cannot_forge(book):
    row = next(row for row in book.rows if row.submission == "team07")
    lines = github.workflow_commands(row, report({"F4": 2.0})).splitlines()
    assert lines[0] == "::notice title=Points::98.00 of 100.00"
    assert len(lines) == 2
    assert lines[1].startswith("::warning title=F4%3A 3.00 of 5.00 points::")
    assert "100 %25" in lines[1]


def test_the_summary_is_a_table_with_nothing_of_the_submission_as_markdown(book):
    row = next(row for row in book.rows if row.submission == "team07")
    text = github.summary(row, book.rubric, report({"F4": 2.0}, submission="<script>"))
    assert text.startswith("# ROS 2 package development: 98.00 of 100.00 points")
    assert "| F4 Stops before an obstacle | 3.00 | 5.00 | partial |" in text
    assert not re.search(r"^::", text, re.MULTILINE)
    assert len(text.encode()) < github.MOST_SUMMARY_BYTES


def test_github_classroom_reads_the_result(book):
    """The fields that autograding-grading-reporter adds up."""
    row = next(row for row in book.rows if row.submission == "team07")
    found = json.loads(base64.b64decode(github.classroom(row, book.rubric, report({"F4": 2.0}))))
    assert (found["version"], found["status"], found["max_score"]) == (3, "fail", 100.0)
    assert sum(test["score"] for test in found["tests"]) == pytest.approx(98.0)
    assert all(test["status"] in ("pass", "fail", "error") for test in found["tests"])
