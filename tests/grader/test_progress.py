"""What `grader` says while it works: names of a submission's choice do nothing to a terminal or a log."""

from __future__ import annotations

import pytest

from grader.progress import Progress


def test_a_name_begins_no_line_and_sends_no_escape(capsys: pytest.CaptureFixture[str]):
    Progress().say("taking in a\n::error title=grader::100 points\x1b[31m.zip")
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "\x1b" not in said
    assert "::error" in said
