"""What `grader` says while it works: names of a submission's choice do nothing to a terminal or a log."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from grader.progress import Progress


def test_a_name_begins_no_line_and_sends_no_escape(capsys: pytest.CaptureFixture[str]):
    Progress().say("taking in a\n::error title=grader::100 points\x1b[31m.zip")
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "\x1b" not in said
    assert "::error" in said


def test_in_a_log_a_step_is_printed_once_however_far_it_is(capsys: pytest.CaptureFixture[str]):
    progress = Progress(clock=lambda: 0.0)
    for what in ("building the package", "building the package (compiling C: 3 of 43)", "own tests (1 of 2 files: a)"):
        progress.say(what)
    assert [line.partition("] ")[2] for line in capsys.readouterr().err.splitlines()] == [
        "building the package", "own tests (1 of 2 files: a)"
    ]  # fmt: skip


def test_in_a_log_a_line_that_changes_is_printed_once_a_minute(capsys: pytest.CaptureFixture[str]):
    """Into a file a batch printed nothing until its first submission was graded."""
    times: Iterator[float] = iter([0.0, 30.0, 61.0, 61.0, 90.0, 100.0, 121.0, 161.0, 161.0])
    progress = Progress(clock=lambda: next(times))
    progress.show("at 30")
    progress.show("at 61")
    progress.show("at 90")
    progress.keep("team07 graded")  # at 100
    progress.show("at 121")
    progress.show("at 161")
    assert capsys.readouterr().err.splitlines() == ["at 61", "team07 graded", "at 161"]
