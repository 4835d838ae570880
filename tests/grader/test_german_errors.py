"""In a German course, what a student reads of an error is German; elsewhere it is English."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from helpers.german import german_course
from helpers.notebook_fixtures import workspace

from grader import notebook
from grader.notebook import clinic, find, frames, packing, pieces
from grader.notebook.workspace import Workspace

__all__ = ["german_course", "workspace"]


def said(call: Callable[[], object], capsys: pytest.CaptureFixture[str]) -> str:
    """Return what a call prints, returns or raises."""
    try:
        found = call()
    except Exception as error:
        found = error
    return capsys.readouterr().out + str(found)


def submit_to_a_place_that_cannot_be_written() -> None:
    package = find().package
    package.mkdir(parents=True)
    (package / "package.xml").write_text("<package/>")
    packing.submit(package, Path("/proc/none/team07.zip"), check=False)


def put_into(cell: str) -> None:
    Path("driver.py").write_text("class Driver:\n    def stop(self):\n        pass\n")
    pieces.into("driver.py", cell, {})


IN_NOTEBOOKS = [
    (lambda: notebook.check("F99"), "There is no requirement 'F99'. There are F1,", "Es gibt keine Anforderung 'F99'"),
    (lambda: notebook.begin("99"), "There is no notebook '99'; there are 00", "Es gibt kein Notebook '99'; es gibt 00"),
    (lambda: clinic.admit("C99"), "There is no case 'C99'; there are C1", "Es gibt keinen Fall 'C99'; es gibt C1"),
    (
        submit_to_a_place_that_cannot_be_written,
        "Cannot write /proc/none/team07.zip: ",
        "/proc/none/team07.zip lässt sich nicht schreiben: ",
    ),
    (
        lambda: put_into("import time\n"),
        "Nothing was written: only functions can go in; `import time` belongs into",
        "Nichts wurde geschrieben: nur Funktionen lassen sich einfügen; `import time` gehört in die Zelle",
    ),
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
def test_a_notebook_of_the_kits_own_course_says_it_in_english(
    call: Callable[[], object], english: str, german: str, workspace: Workspace, capsys: pytest.CaptureFixture[str]
):
    assert english in said(call, capsys)


@pytest.mark.parametrize(("call", "english", "german"), IN_NOTEBOOKS)
def test_a_notebook_of_a_german_course_says_it_in_german(
    call: Callable[[], object],
    english: str,
    german: str,
    german_course: Path,
    workspace: Workspace,
    capsys: pytest.CaptureFixture[str],
):
    notebook.course()  # as the import of grader.notebook in a kernel does
    assert german in said(call, capsys)
