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

from grader import cli
from grader.classroom import cells, gradebook
from grader.classroom.platform import Delivery, losses, short
from grader.classroom.platforms import canvas, github, gradescope, moodle, plain
from grader.errors import GraderError

EXCUSED = "people: {s4: {excused: {why: ill, by: Ada}}}"


def rows(path: Path) -> list[list[str]]:
    return list(csv.reader(io.StringIO(path.read_text())))


@pytest.fixture
def book(class_of_four):
    return gradebook.read(class_of_four(EXCUSED, zero_missing=True))


@pytest.mark.parametrize("start", ["=", "+", "-", "@", "\t", "\r", "＝"])
def test_a_cell_never_begins_like_a_formula(start):
    assert cells.neutral(f"{start}cmd|' /C calc'!A0").startswith("'")


SHEET = (
    'Identifier,"Full name",Grade\n'
    'Participant 1,"Doe; ""J""",\n'
    "\n"
    'Participant 2,=Li,"98,00"\n'
    "Participant 3\n"
    'Participant 4, "odd" quotes,7'
)


@pytest.mark.parametrize("separator", [",", ";", "\t"])
@pytest.mark.parametrize("end", ["\r\n", "\n", "\r"])
@pytest.mark.parametrize("mark", ["\ufeff", ""])
def test_only_the_cells_that_are_set_differ_in_a_sheet(tmp_path, separator, end, mark):
    """The byte order mark was lost, CRLF became LF, and cells lost their quotes."""
    text = mark + SHEET.replace("\n", end).replace(",", separator)
    (tmp_path / "a.csv").write_bytes(text.encode())
    sheet = cells.Sheet(tmp_path / "a.csv")
    assert [row[1] for row in sheet.rows] == ['Doe; "J"', "", "=Li", "", ' "odd" quotes']
    sheet.write(tmp_path / "same.csv")
    assert (tmp_path / "same.csv").read_bytes() == text.encode()
    sheet.set(0, 2, "1.50")
    sheet.set(3, 2, "2.50")
    sheet.set(4, 2, "7")
    sheet.write(tmp_path / "set.csv")
    wanted = text.replace(f'""J"""{separator}', f'""J"""{separator}1.50')
    wanted = wanted.replace("Participant 3", f"Participant 3{separator}{separator}2.50")
    assert (tmp_path / "set.csv").read_bytes() == wanted.encode()


@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_no_cell_ends_at_another_countrys_separator(tmp_path, separator):
    """A name `Ann;=1+2` was two cells where spreadsheets separate by semicolons, and the second a formula."""
    row = ["Ann;=1+2", "a,b", "c\td", 'say "x"', "two\nlines", "plain"]
    (tmp_path / "a.csv").write_text(separator.join("abcdef") + "\n" + separator * 5 + "\n")
    sheet = cells.Sheet(tmp_path / "a.csv")
    for column, cell in enumerate(row):
        sheet.set(0, column, cell)
    sheet.write(tmp_path / "a.csv")
    text = (tmp_path / "a.csv").read_text()
    assert list(csv.reader(io.StringIO(text, newline=""), delimiter=separator))[1] == row
    assert re.sub(r'"(?:[^"]|"")*"', "", text).splitlines()[1] == separator * 5 + "plain"


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


def numbered_by(platform: str, book: gradebook.Gradebook) -> gradebook.Gradebook:
    return replace(book, rows=tuple(replace(row, person=replace(row.person, lms=platform)) for row in book.rows))


CANVAS_EXPORT = (
    "Student,ID,SIS User ID,SIS Login ID,Section,Quiz (70),Robots (77),Current Score\n"
    "    Points Possible,,,,,10,100,(read only)\n"
    '"Doe, Jane",12345,s1,jdoe,A,9,,90\n'
    '"Ek, Bo",,s3,boek,A,8,55,80\n'
    '"Ost, Eva",,s4,eost,A,8,61,80\n'
    '"Nobody, Known",99999,,,B,7,44,70\n'
    '"Student, Test",88888,,,A,,,\n'
)


def filled(platform, book, tmp_path, text: str, title: str = "") -> tuple[str, list[str]]:
    """Return a sheet with the grades filled in, and the remarks."""
    (tmp_path / "sheet.csv").write_bytes(text.encode())
    reports = {"team07": report({"F4": 2.0})}
    delivery = Delivery(book, reports, tmp_path / "filled.csv", tmp_path / "sheet.csv", title)
    notes = platform.PLATFORM.write(delivery)
    return (tmp_path / "filled.csv").read_bytes().decode(), notes


def test_a_participants_number_of_moodle_is_no_number_of_canvas(book, tmp_path):
    """It was written into the column ID, by which Canvas looks first: that of another person."""
    sheet = CANVAS_EXPORT.replace("99999,,", "12346,,")
    _, notes = filled(canvas, numbered_by("moodle", book), tmp_path, sheet, "Robots")
    assert "not known to the gradebook; their lines stay as they were: Nobody, Known" in notes


def test_a_gradebook_that_canvas_exported_is_filled_in_and_nothing_else_changes(class_of_four, tmp_path):
    text, notes = filled(canvas, gradebook.read(class_of_four(zero_missing=True)), tmp_path, CANVAS_EXPORT, "Robots")
    assert text == CANVAS_EXPORT.replace("A,9,,90", "A,9,98.00,90").replace("A,8,55,80", "A,8,0.00,80")
    assert notes == [
        "not known to the gradebook; their lines stay as they were: Nobody, Known",
        "graded or excused in the sheet by a person, which stays: Ost, Eva (61)",
        "had another grade in the sheet: Ek, Bo (55, now 0.00)",
    ]


def test_an_excuse_in_canvas_stays_and_ours_is_written(book, tmp_path):
    sheet = CANVAS_EXPORT.replace("A,9,,90", "A,9,EX,90")
    text, notes = filled(canvas, book, tmp_path, sheet, "Robots")
    assert text == sheet.replace("A,8,55,80", "A,8,0.00,80").replace("A,8,61,80", "A,8,EX,80")
    assert "graded or excused in the sheet by a person, which stays: Doe, Jane (EX)" in notes


@pytest.mark.parametrize("platform", [canvas, moodle])
@pytest.mark.parametrize("state", [gradebook.State.PENDING, gradebook.State.TO_GRADE])
def test_a_row_that_is_not_final_keeps_its_cells(book, tmp_path, platform, state):
    """Its grade and its comment were emptied; a total that waits for a person was a score in Canvas."""
    waiting = replace(book, rows=tuple(replace(row, state=state) for row in book.rows))
    sheet = CANVAS_EXPORT if platform is canvas else MOODLE_SHEET
    text, notes = filled(platform, waiting, tmp_path, sheet, "Robots")
    assert text == sheet
    assert any("not final yet" in note and f"({state.value})" in note for note in notes)
    assert {canvas._score(row) for row in waiting.rows} == {""}


def test_other_points_possible_are_refused(book, tmp_path):
    with pytest.raises(GraderError, match=r"has 50 points in Canvas, the rubric 100"):
        filled(canvas, book, tmp_path, CANVAS_EXPORT.replace(",10,100,", ",10,50,"), "Robots (77)")


MOODLE_SHEET = (
    "\ufeffIdentifier,Full name,Email address,Status,Grade,Maximum grade,Last modified (grade),Feedback comments\r\n"
    'Participant 12345,Jane Doe,jane@uni.edu,"Submitted",,100.00,-,"<p>Come and see me, ""please"".</p>"\r\n'
    "Participant 777,Bo Ek,bo@uni.edu,Submitted,55.00,100.00,-,\r\n"
    'Participant 12348,"Eva Ost",eva@uni.edu,No submission,61.00,100.00,-,oral exam\r\n'
    "Participant 778,Nobody,n@x,No submission,,100.00,-,=1+1\r\n"
)
OURS = (
    "[Automatic grading: 98.00 of 100.00 points<br>F4: touched it at 7.3 s, 2.00 of 5.00 points lost]",
    "[Automatic grading: 0.00 of 100.00 points<br>cannot be graded]",
)


def test_moodles_worksheet_is_filled_in_and_what_a_person_wrote_stays(class_of_four, tmp_path):
    """A comment was overwritten, a missing person's grade became 0, and mark and line ends were lost."""
    folder = class_of_four(zero_missing=True)
    text, notes = filled(moodle, gradebook.read(folder), tmp_path, MOODLE_SHEET)
    wanted = MOODLE_SHEET.replace('Submitted",,', 'Submitted",98.00,').replace("Submitted,55.00", "Submitted,0.00")
    wanted = wanted.replace('""please"".</p>"', f'""please"".</p><br>{OURS[0]}"')
    wanted = wanted.replace("-,\r\n", '-,"[Automatic grading: 0.00 of 100.00 points<br>boek.zip is empty.]"\r\n')
    assert text.replace('"', "") == wanted.replace('"', "")
    assert [line for line in text.splitlines() if "Nobody" in line] == [MOODLE_SHEET.splitlines()[-1]]
    assert text.startswith("\ufeffIdentifier,")
    assert 'jane@uni.edu,"Submitted",98.00' in text
    assert len(notes) == 3


def test_a_message_of_several_lines_is_one_line_of_a_comment(class_of_four, tmp_path):
    r"""Moodle's comments, and GitHub's, had a `\n` in them that was to be read."""
    folder = class_of_four()
    made = report({"F4": 2.0})
    wall = next(each for each in made["requirements"] if each["id"] == "F4")
    wall["seen"] = wall["checks"][0]["seen"] = "stopped:\n  at the wall"
    row = next(row for row in gradebook.read(folder).rows if row.submission == "team07")
    assert "F4: stopped: at the wall, 2.00 of 5.00 points lost" in short(row, made)
    assert list(losses(wall))[1:3] == ["  seen      stopped:", "              at the wall"]
    texts = [
        github.workflow_commands(row, gradebook.read(folder).rubric, made),
        github.summary(row, gradebook.read(folder).rubric, made),
    ]
    assert not [text for text in texts if "\\n" in text]


def test_filling_twice_appends_once_and_replaces_what_we_said_before(class_of_four, tmp_path):
    folder = class_of_four()
    once, _ = filled(moodle, gradebook.read(folder), tmp_path, MOODLE_SHEET)
    assert filled(moodle, gradebook.read(folder), tmp_path, once)[0] == once
    folder.overrides.write_text("submissions: {team07: {adjust: {points: -8, why: late at the lab, by: Ada}}}")
    again, notes = filled(moodle, gradebook.read(folder), tmp_path, once.replace("98.00,100.00", '"98,00",100.00'))
    line = next(line for line in again.splitlines() if "Jane" in line)
    assert line.count("[Automatic grading") == 1
    assert "Come and see me" in line
    assert "90.00 of 100.00 points<br>-8 points by Ada (late at the lab)" in line
    assert "had another grade in the sheet: Jane Doe (98,00, now 90.00)" in notes


def test_nothing_of_a_submission_is_html_or_ends_our_comment(class_of_four, tmp_path):
    lost = report({"F4": 2.0})
    for each in lost["requirements"]:
        each["seen"] = "<script>x</script> ] & [y"
    book = gradebook.read(class_of_four())
    (tmp_path / "sheet.csv").write_text(MOODLE_SHEET)
    moodle.PLATFORM.write(Delivery(book, {"team07": lost}, tmp_path / "a.csv", tmp_path / "sheet.csv"))
    moodle.PLATFORM.write(Delivery(book, {"team07": lost}, tmp_path / "b.csv", tmp_path / "a.csv"))
    text = (tmp_path / "a.csv").read_text()
    assert "&lt;script&gt;x&lt;/script&gt; ) &amp; (y" in text
    assert (tmp_path / "b.csv").read_text() == text


def test_a_bonus_beyond_the_maximum_is_cut_for_moodle_and_said(class_of_four, tmp_path):
    """Moodle skips such a line without a word."""
    book = gradebook.read(class_of_four("people: {s1: {bonus: {points: 9, why: x, by: Ada}}}"))
    text, notes = filled(moodle, book, tmp_path, MOODLE_SHEET)
    assert 'jane@uni.edu,"Submitted",100.00,100.00' in text
    assert "more than the maximum, which is all that Moodle takes: Jane Doe" in notes
    assert canvas._score(next(row for row in book.rows if row.person.id == "s1")) == "107.00"


def test_a_german_worksheet_is_filled_in(book, tmp_path):
    sheet = (
        "ID,Vollst\u00e4ndiger Name,E-Mail-Adresse,Status,Bewertung,Bestwertung,Bewertung kann ge\u00e4ndert werden,"
        "Zuletzt ge\u00e4ndert (Abgabe),Zuletzt ge\u00e4ndert (Bewertung),Feedback als Kommentar\n"
        'Teilnehmer/in12345,Jane Doe,jane@uni.edu,Abgegeben,,"100,00",Ja,-,-,\n'
    )
    text, _ = filled(moodle, book, tmp_path, sheet)
    assert text == sheet.replace("Abgegeben,,", "Abgegeben,98.00,").replace("Ja,-,-,", f'Ja,-,-,"{OURS[0]}"')
    with pytest.raises(GraderError, match="maximum grade in Moodle is 10,00"):
        filled(moodle, book, tmp_path, sheet.replace("100,00", "10,00"))


def test_a_sheet_of_another_kind_is_refused(book, tmp_path):
    for platform, said in ((canvas, "not a gradebook of Canvas"), (moodle, "not an offline grading worksheet")):
        with pytest.raises(GraderError, match=said):
            filled(platform, book, tmp_path, "a,b\n1,2\n")


@pytest.mark.parametrize("platform", [gradescope, github])
def test_one_members_excuse_is_not_what_the_team_gets(class_of_four, tmp_path, platform):
    """Files by submission had the figures of the team's last member: excused, so 0 for all."""
    book = gradebook.read(class_of_four("people: {s2: {excused: {why: had the flu, by: Ada}}}"))
    notes = platform.PLATFORM.write(Delivery(book, {"team07": report({"F4": 2.0})}, tmp_path))
    texts = "".join(path.read_text() for path in (tmp_path / "team07").iterdir())
    assert '"score": 98.0' in texts or "98.00 of 100.00" in texts
    assert "flu" not in texts
    assert any("=Li Wu has excused, the team 98.00 points" in note for note in notes)


def test_gradescope_reads_results_json(book, tmp_path):
    """The fields and types of gradescope/autograder_samples, docs/specs.md."""
    gradescope.PLATFORM.write(Delivery(book, {"team07": report({"F4": 2.0})}, tmp_path))
    found = json.loads((tmp_path / "team07" / "results.json").read_text())
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


@pytest.mark.sandbox
def test_a_single_refusal_becomes_results_json_too(tmp_path):
    """Gradescope said that the autograder had failed, for each submission without a package."""
    (tmp_path / "homework").mkdir()
    (tmp_path / "homework" / "main.py").write_text("print('not a package')\n")
    assert cli.main(["grade", str(tmp_path / "homework"), "--out", str(tmp_path / "out")]) == 1
    words = ["gradebook", str(tmp_path / "out"), "--for", "gradescope", "--out", str(tmp_path / "results")]
    assert cli.main(words) == 0
    (path,) = (tmp_path / "results").rglob("results.json")
    results = json.loads(path.read_text())
    assert results["score"] == 0.0
    assert results["output"] == (
        "homework contains no package.xml. Zip the package folder itself (the one with package.xml and setup.py) and "
        "submit again."
    )


def test_github_gets_annotations_a_summary_and_a_result_that_a_submission_cannot_forge(book, tmp_path):
    """The fields of the result are those that autograding-grading-reporter adds up."""
    lost = report({"F4": 2.0}, submission="<script>")
    github.PLATFORM.write(Delivery(book, {"team07": lost}, tmp_path))
    annotations, summary, result = (
        (tmp_path / "team07" / name).read_text() for name in ("annotations.txt", "summary.md", "classroom.txt")
    )
    first, second = annotations.splitlines()
    assert first == "::notice title=Points::98.00 of 100.00"
    assert second.startswith("::warning title=F4%3A 3.00 of 5.00 points::")
    assert "100 %25" in second
    assert summary.startswith("# ROS 2 package development: 98.00 of 100.00 points")
    assert "| F4 Stops before an obstacle | 3.00 | 5.00 | partial |" in summary
    assert not re.search(r"^::", summary, re.MULTILINE)
    assert len(summary.encode()) < github.MOST_SUMMARY_BYTES
    found = json.loads(base64.b64decode(result.removeprefix("result=")))
    assert (found["version"], found["status"], found["max_score"]) == (3, "fail", 100.0)
    assert sum(test["score"] for test in found["tests"]) == pytest.approx(98.0)
    assert all(test["status"] in ("pass", "fail", "error") for test in found["tests"])
