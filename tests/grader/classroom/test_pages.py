"""The commands of docs/term.md and docs/classes.md work as they are typed; only the gradings are made up."""

from __future__ import annotations

import csv
import json
import re
import shlex
import zipfile
from pathlib import Path

import pytest
from helpers.class_reports import GRADED, report
from submissions import term_export

from grader import KIT, cli
from grader.classroom import batch
from grader.classroom.one_grading import Ending, Order

COMMAND = re.compile(r"^    grader (.*?)\s*(?:#.*)?$", re.MULTILINE)


def commands(page: str) -> list[list[str]]:
    return [shlex.split(line) for line in COMMAND.findall((KIT / "docs" / page).read_text())]


@pytest.fixture
def here(tmp_path, monkeypatch, workers) -> Path:
    """Return the current folder, in which whatever is handed in is graded: Jane loses F4 in part, others F8."""

    def grade(order: Order) -> Ending:
        lost = {"F4": 2.0} if "jane" in order.source.lower() else {"F8": 6.0}
        made = report(lost, submission=Path(order.source).name)
        (Path(order.out) / "report.json").write_text(json.dumps(made))
        (Path(order.out) / "report.html").write_text("<p>the report</p>")
        return GRADED

    workers(grade)
    monkeypatch.setattr(batch.sandbox, "require", lambda: None)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def term(here) -> Path:
    """Return that folder with all that docs/term.md says is there."""
    term_export.make(here)
    (text,) = re.findall(r"## term.yaml\n\n((?:    .*\n)+)", (KIT / "docs" / "term.md").read_text())
    (here / "term.yaml").write_text(re.sub("^    ", "", text, flags=re.MULTILINE))
    return here


@pytest.fixture
def canvas_class(here) -> Path:
    """Return that folder with an export of Canvas, a roster, and the gradebook that Canvas exported."""
    with zipfile.ZipFile(here / "export.zip", "w") as export:
        export.writestr("doejane_101_9001_robots.zip", "x")
        export.writestr("ekbo_LATE_102_9002_robots.zip", "y")
    (here / "roster.csv").write_text(
        "id,name,email,submitted\ns1,Jane Doe,,2026-11-20T12:00\ns2,Bo Ek,,2026-11-21T12:00\n"
    )
    (here / "canvas_export.csv").write_text(CANVAS)
    return here


CANVAS = """\
Student,ID,SIS User ID,SIS Login ID,Section,Quiz (70),Robots (77)
    Points Possible,,,,,10,100
"Doe, Jane",101,s1,jdoe,A,9,
"Ek, Bo",102,s2,boek,A,8,
"""


@pytest.mark.slow  # ten commands
def test_a_term_in_ten_commands_is_graded_as_it_is_typed(term: Path, capsys):
    typed = commands("term.md")
    assert len(typed) == 10
    said = []
    for command in typed:
        assert cli.main(command) == 0, (command, capsys.readouterr().err)
        said.append(capsys.readouterr().out)
    plan, *_, shown, _, written, totals, _ = said
    assert not re.search("^DOUBT|^doubt", "".join(said), re.MULTILINE)
    assert re.search(r"team07 +Jane Doe +Jane Doe, Li Wu .* in time", plan)
    assert re.search(r"s1232 +Bo Ek .* late by 11:03:00, 1 started day", plan)
    assert "not decided yet" in shown
    assert "report.html#F4" in shown
    assert "Feedback: sheet1_moodle_feedback.zip" in written
    assert "5 people, 5 with a total of at most 100.00; 0 doubts" in totals
    filled = {line["ID number"]: line for line in csv.DictReader(Path("sheet1_moodle.csv").read_text().splitlines())}
    assert (filled["s1230"]["Grade"], filled["s1231"]["Grade"], filled["s1235"]["Grade"]) == ("98.00", "98.00", "0.00")
    assert filled["s1232"]["Grade"] == "84.60", "10 % of 94 are deducted"
    assert filled["s1232"]["Feedback comments"].startswith("See me. A. Lee<br>[Automatic grading: 84.60")
    assert "F4: 3 points by A. Lee (so it did; asked because" in filled["s1230"]["Feedback comments"]
    with zipfile.ZipFile("sheet1_moodle_feedback.zip") as feedback:
        assert {name.split("_")[1] for name in feedback.namelist()} == {"10000", "10001", "10002", "10003"}
    assert "Bo Ek" in Path("totals.csv").read_text()
    kept = [Path("totals.csv"), *Path("sheet1").rglob("*"), *Path("sheet2").rglob("*")]
    assert not [path for path in kept if path.is_file() and b"Eva" in path.read_bytes()]


def test_a_class_is_graded_by_the_first_commands_of_its_page(canvas_class: Path, capsys):
    """The last one ended with an error: there are several assignments in nearly every gradebook."""
    for command in commands("classes.md")[:3]:
        assert cli.main(command) == 0, (command, capsys.readouterr().err)
    assert Path("canvas_import.csv").read_text() == CANVAS.replace("A,9,", "A,9,98.00").replace("A,8,", "A,8,84.60")
    assert cli.main(["gradebook", "class", "--for", "canvas", "--sheet", "canvas_export.csv"]) == 2
    assert "Quiz (70), Robots (77). Add --assignment." in capsys.readouterr().err


def test_feedback_is_asked_for_and_written_where_the_command_says(canvas_class: Path, capsys):
    assert cli.main(["batch", "export.zip", "--roster", "roster.csv", "--out", "class"]) == 0
    assert cli.main(["gradebook", "class", "--for", "canvas", "--feedback"]) == 0
    assert "Feedback: class/canvas_feedback.zip" in capsys.readouterr().out
    with zipfile.ZipFile("class/canvas_feedback.zip") as feedback:
        assert set(feedback.namelist()) == {"student_101_9001_report.zip", "student_102_9002_report.zip"}
    for platform in ("csv", "gradescope", "github"):
        assert cli.main(["gradebook", "class", "--for", platform, "--feedback"]) == 2
        assert "--feedback is for the classes of --for moodle and --for canvas." in capsys.readouterr().err


def test_one_grading_goes_to_github_as_its_page_says(here: Path, capsys):
    Path("out").mkdir()
    Path("out/report.json").write_text(json.dumps(report({"F4": 2.0})))
    (command,) = (each for each in commands("classes.md") if each[:2] == ["gradebook", "out"])
    assert cli.main(command) == 0
    (annotations,) = Path("export").glob("*/annotations.txt")
    assert "98.00 of 100.00" in annotations.read_text()
    assert {path.name for path in annotations.parent.iterdir()} == {"annotations.txt", "summary.md", "classroom.txt"}
