"""The answer of a check, as text and as HTML."""

from __future__ import annotations

import pytest

from grader.notebook.feedback import Answer, Checked, Note
from grader.report.figures import Figure

SEEN = Note("", (("seen", "touched the wall at 7.3 s"), ("expected", "never touches it"), ("try", "look ahead")))
STOPPED = Answer("F4", "Stops", "5", "5", passed=True)
TOUCHED = Answer("F4", "Stops", "2", "5", passed=False, notes=(SEEN,), section="Taught in notebook 05.")


SAMPLE = Answer("T3", "Tests that notice", "6", "6", passed=True, sample="a sample: 10 of 51 mutants tried")
OURS = Answer("F1", "Idle", "0", "3", passed=False, ours=True)
OTHER = Note("`cmd_vel` comes at 10 Hz.", (("seen", "2 Hz"),))
ROWS = "    seen      touched the wall at 7.3 s\n    expected  never touches it\n    try       look ahead"
TWO = f"F1 not yet (0 of 3)\n{ROWS}\n  `cmd_vel` comes at 10 Hz.\n    seen      2 Hz"


@pytest.mark.parametrize(
    ("answer", "shown", "passed"),
    [
        (STOPPED, "F4 passed (5 of 5)", True),
        # It said "passed (6 of 6)" after ten of 51 mutants.
        (SAMPLE, "T3 passed (6 of 6; a sample: 10 of 51 mutants tried)", True),
        (TOUCHED, f"F4 not yet (2 of 5)\n{ROWS}", False),
        (Answer("F1", "Idle", "0", "3", False, notes=(SEEN, OTHER)), TWO, False),
        (OURS, "F1 could not be judged", False),
    ],
)
def test_an_answer_as_text(answer: Answer, shown: str, passed: bool) -> None:
    assert repr(Checked((answer,))) == shown
    assert Checked((answer,)).passed is passed


def test_long_lines_are_wrapped_and_line_breaks_kept() -> None:
    note = Note("", (("seen", "not found:\n" + "word " * 40),))
    lines = repr(Checked((Answer("Q5", "README", "0", "3", False, notes=(note,)),))).splitlines()
    assert lines[1] == "    seen      not found:"
    assert all(len(line) <= 100 for line in lines)
    assert lines[2].startswith("              word")


def test_all_must_pass() -> None:
    assert not Checked((STOPPED, TOUCHED)).passed


def test_the_page_is_self_contained_and_escaped() -> None:
    note = Note("", (("seen", "<script>alert(1)</script> and `min([])`"),))
    picture = Figure("obstacle", "data:image/png;base64,AA", 'The "robot" went')
    page = Checked((Answer("F6", "Bad", "0", "3", False, notes=(note,)),), (picture,))._repr_html_()
    assert "<script>" not in page
    assert "&lt;script&gt;" in page
    assert "<code>min([])</code>" in page
    assert 'alt="The &quot;robot&quot; went"' in page
    assert "http" not in page
    assert "<style" not in page  # it would colour the whole notebook


def test_the_page_names_the_section_of_a_requirement_until_it_is_passed() -> None:
    assert "Taught in notebook 05." in Checked((TOUCHED,))._repr_html_()
    assert "Taught in" not in Checked((STOPPED,))._repr_html_()


def test_the_page_uses_only_middle_tones() -> None:
    """Black on a dark theme, or white on a light one, would be unreadable."""
    page = Checked((STOPPED, TOUCHED))._repr_html_()
    assert "background:#" not in page
    assert "color:#000" not in page
    assert "color:#fff" not in page
