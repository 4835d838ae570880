"""The commands of docs/classes.md work as they are typed; only the gradings are made up."""

from __future__ import annotations

import json
import re
import shlex
import zipfile
from pathlib import Path

import pytest
from helpers.class_reports import GRADED, report

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


def test_a_class_is_graded_by_the_first_commands_of_its_page(canvas_class: Path, capsys):
    """The last one ended with an error: there are several assignments in nearly every gradebook."""
    for command in commands("classes.md")[:3]:
        assert cli.main(command) == 0, (command, capsys.readouterr().err)
    assert Path("canvas_import.csv").read_text() == CANVAS.replace("A,9,", "A,9,98.00").replace("A,8,", "A,8,84.60")
    assert cli.main(["gradebook", "class", "--for", "canvas", "--sheet", "canvas_export.csv"]) == 2
    assert "Quiz (70), Robots (77). Add --assignment." in capsys.readouterr().err
    assert cli.main(["gradebook", "class", "--for", "moodle"]) == 2
    assert "Add --sheet." in capsys.readouterr().err


def test_one_grading_goes_to_github_as_its_page_says(here: Path, capsys):
    Path("out").mkdir()
    Path("out/report.json").write_text(json.dumps(report({"F4": 2.0})))
    (command,) = (each for each in commands("classes.md") if each[:2] == ["gradebook", "out"])
    assert cli.main(command) == 0
    (annotations,) = Path("export").glob("*/annotations.txt")
    assert "98.00 of 100.00" in annotations.read_text()
    assert {path.name for path in annotations.parent.iterdir()} == {"annotations.txt", "summary.md", "classroom.txt"}
