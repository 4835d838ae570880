"""In a German course, what a student reads of an error is German; elsewhere it is English."""

from __future__ import annotations

import html
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from helpers.archives import NODE, XML, below, write, zipped
from helpers.course import COURSE, copied
from helpers.notebook_fixtures import workspace

from grader import cli, notebook, words
from grader.course import find as find_course
from grader.course.reader import VARIABLE
from grader.courses.robot_controller.lessons import frames
from grader.errors import GraderError
from grader.host import namespaces, shortage
from grader.intake.submission import open_submission
from grader.notebook import pieces
from grader.notebook.workspace import Workspace
from grader.processes import supervised
from grader.words import say

__all__ = ["workspace"]


@pytest.fixture
def german_course(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The folder of the kit's own course in German, which `grader.course.find` finds."""
    folder = copied(tmp_path / "kurs", more="language: de\n")
    monkeypatch.setenv(VARIABLE, str(folder))
    yield folder
    words.speak(words.ENGLISH, COURSE.folder)


def said(call: Callable[[], object], capsys: pytest.CaptureFixture[str]) -> str:
    """Return what a call prints, returns or raises."""
    try:
        found = call()
    except Exception as error:
        found = error
    return capsys.readouterr().out + str(found)


def put_into(cell: str) -> None:
    Path("driver.py").write_text("class Driver:\n    def stop(self):\n        pass\n")
    pieces.into("driver.py", cell)


IN_NOTEBOOKS = [
    (lambda: notebook.check("F99"), "There is no requirement 'F99'. There are F1,", "Es gibt keine Anforderung 'F99'"),
    (lambda: notebook.begin("99"), "There is no notebook '99'; there are 00", "Es gibt kein Notebook '99'; es gibt 00"),
    (
        lambda: put_into("class Driver:\n    def stopp(self):\n        pass\n"),
        "Nothing was written: the file has no function `stopp`; did you mean `stop`?",
        "Nichts wurde geschrieben: die Datei hat keine Funktion `stopp`; meinst du `stop`?",
    ),
    (
        lambda: notebook.tries({"1 + 1": 3}),
        "NOT YET  1 + 1  2, wanted 3\n0 of 1 right",
        "NOCH NICHT  1 + 1  2, erwartet 3\n0 von 1 richtig",
    ),
    (
        lambda: repr(frames.check("TF1", lambda a, _b: a, lambda a: a)),
        "try       turn b's x and y by a's yaw",
        "drehe x und y von b um den yaw von a",
    ),
]


@pytest.mark.parametrize(("call", "english", "german"), IN_NOTEBOOKS)
def test_a_notebook_says_it_in_the_language_of_its_course(
    call: Callable[[], object], english: str, german: str, workspace: Workspace,
    capsys: pytest.CaptureFixture[str], request: pytest.FixtureRequest,
):  # fmt: skip
    assert english in said(call, capsys)
    request.getfixturevalue("german_course")
    notebook.course()  # as the import of grader.notebook in a kernel does
    assert german in said(call, capsys)


HANDED_IN = [
    (
        {"team07.zip": ""},
        ["team07.zip ist eine leere Datei.", "Packe den Ordner des Pakets in ein Zip-Archiv, und gib"],
    ),
    (
        {"a.zip": "no zip", "b.rar": "Rar!"},
        [
            "a.zip wurde nicht geöffnet: a.zip ist weder ein Ordner",
            "b.rar wurde nicht geöffnet: Das Bewertungsprogramm öffnet nur Zip- und Tar-Archive.",
        ],
    ),
]


@pytest.mark.sandbox  # which must be there before anything is taken in
@pytest.mark.parametrize(("files", "german"), HANDED_IN)
def test_the_report_of_what_cannot_be_opened_is_german(
    files: dict[str, str], german: list[str], german_course: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    out, handed_in = tmp_path / "out", write(tmp_path / "handed_in", files)
    source = handed_in / "team07.zip" if "team07.zip" in files else handed_in
    assert cli.main(["grade", str(source), "--out", str(out)]) == 1
    printed, page = capsys.readouterr().err, html.unescape((out / "report.html").read_text())
    assert [words for words in german if words not in printed or words not in page] == []


def test_the_choice_between_packages_is_explained_in_german(german_course: Path, tmp_path: Path):
    find_course()
    files = {
        **below("a/"),
        "a/data.zip": "",
        "b/package.xml": XML.format("my_old_robot"),
        "b/my_old_robot/driver.py": NODE,
        "c/package.xml": XML.format("my_messages"),
        "c/msg/A.msg": "",
    }
    intake = open_submission(zipped(tmp_path / "team07.zip", files), tmp_path / "in", COURSE).intake
    assert intake.chosen_because == "es den Namen hat, den die Aufgabe verlangt"
    assert intake.others == ["b (my_old_robot)", "c (my_messages)"]
    assert intake.notes == ["a/data.zip wurde nicht geöffnet: Es gibt ein Paket außerhalb davon."]


ON_THIS_MACHINE = [
    (
        lambda: shortage.explain(MemoryError()),
        "The grader has run out of memory. No points are",
        "ist der Speicher aus",
    ),
    (
        namespaces.notice,
        "Graded with --unsafe-no-sandbox: the submission",
        "Bewertet mit --unsafe-no-sandbox: Der Code",
    ),
]


@pytest.mark.parametrize(("call", "english", "german"), ON_THIS_MACHINE)
def test_what_this_machine_lacks_is_said_in_the_language_of_the_course(
    call: Callable[[], str], english: str, german: str, monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest
):
    monkeypatch.setenv(namespaces.UNSAFE_VARIABLE, "1")
    assert english in call()
    request.getfixturevalue("german_course")
    find_course()
    assert german in call()


@pytest.mark.sandbox
def test_the_commands_refuse_in_german(german_course: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    assert cli.main(["check", "F1", "--package", str(tmp_path / "none")]) == 1
    assert f"grader: Es gibt weder eine Datei noch einen Ordner {tmp_path}/none. Prüfe" in capsys.readouterr().err
    other, out = write(tmp_path / "other", {"team07.zip": ""}) / "team07.zip", tmp_path / "out"
    first = write(tmp_path, {"team07.zip": ""}) / "team07.zip"
    assert cli.main(["grade", str(first), "--out", str(out)]) == 1
    assert capsys.readouterr().out == f"Bericht: {out}/report.html\n"
    assert cli.main(["grade", str(other), "--out", str(out)]) == 2
    assert f"In {out} ist der Bericht zu team07.zip; es wurde nichts geschrieben." in capsys.readouterr().err


@pytest.mark.parametrize(
    ("error", "status", "german"),
    [
        (lambda: KeyboardInterrupt(), 130, "grader: abgebrochen; es wurde nichts geschrieben.\n"),
        (lambda: GraderError(say(shortage.KILLED)), 3, "grader: Ein Prozess des Bewertungsprogramms wurde von außen"),
    ],
)
def test_the_end_of_a_check_from_outside_is_said_in_german(
    error: Callable[[], BaseException],
    status: int,
    german: str,
    german_course: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
):
    def end(_work: Callable[[], int]) -> int:
        raise error()

    monkeypatch.setattr(supervised, "run", end)
    monkeypatch.setattr(sys, "argv", ["grader", "check", "F1"])
    assert cli.main() == status
    assert german in capsys.readouterr().err
