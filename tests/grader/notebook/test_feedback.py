"""What a check says: in words, and on the page."""

from __future__ import annotations

from grader.notebook.feedback import Answer, Checked, Note
from grader.report.album import Picture

SEEN = Note("", (("seen", "touched the wall at 7.3 s"), ("expected", "never touches it"), ("try", "look ahead")))
STOPPED = Answer("F4", "Stops", "5", "5", passed=True)
TOUCHED = Answer("F4", "Stops", "2", "5", passed=False, notes=(SEEN,), section="Taught in notebook 05.")


def test_a_passed_requirement_takes_one_line() -> None:
    assert repr(Checked((STOPPED,))) == "F4 passed (5 of 5)"


def test_one_that_is_not_there_yet_says_seen_expected_try() -> None:
    assert repr(Checked((TOUCHED,))).splitlines() == [
        "F4 not yet (2 of 5)",
        "    seen      touched the wall at 7.3 s",
        "    expected  never touches it",
        "    try       look ahead",
    ]


def test_several_findings_stand_under_their_headings() -> None:
    other = Note("`cmd_vel` comes at 10 Hz.", (("seen", "2 Hz"),))
    said = repr(Checked((Answer("F1", "Idle", "0", "3", False, notes=(SEEN, other)),)))
    assert "\n  `cmd_vel` comes at 10 Hz.\n    seen      2 Hz" in said


def test_long_words_are_wrapped_and_lines_kept() -> None:
    note = Note("", (("seen", "not found:\n" + "word " * 40),))
    lines = repr(Checked((Answer("Q5", "README", "0", "3", False, notes=(note,)),))).splitlines()
    assert lines[1] == "    seen      not found:"
    assert all(len(line) <= 100 for line in lines)
    assert lines[2].startswith("              word")


def test_points_and_passed_are_for_programs() -> None:
    assert Checked((STOPPED, TOUCHED)).points == 7.0
    assert not Checked((STOPPED, TOUCHED)).passed
    assert Checked((STOPPED,)).passed


def test_a_fault_of_ours_is_no_pass_and_no_fault_of_the_students() -> None:
    ours = Answer("F1", "Idle", "0", "3", passed=False, ours=True)
    assert repr(Checked((ours,))) == "F1 could not be judged"
    assert not Checked((ours,)).passed


def test_the_page_needs_nothing_from_elsewhere_and_escapes_what_it_shows() -> None:
    note = Note("", (("seen", "<script>alert(1)</script> and `min([])`"),))
    picture = Picture("obstacle", "data:image/png;base64,AA", 'The "robot" went')
    page = Checked((Answer("F6", "Bad", "0", "3", False, notes=(note,)),), (picture,))._repr_html_()
    assert "<script>" not in page
    assert "&lt;script&gt;" in page
    assert "<code>min([])</code>" in page
    assert 'alt="The &quot;robot&quot; went"' in page
    assert "http" not in page
    assert "<style" not in page  # it would colour the whole notebook


def test_the_page_says_where_it_is_taught_until_it_is_passed() -> None:
    assert "Taught in notebook 05." in Checked((TOUCHED,))._repr_html_()
    assert "Taught in" not in Checked((STOPPED,))._repr_html_()


def test_no_colour_of_the_page_is_fixed_but_for_middle_tones() -> None:
    """Black on a dark theme, or white on a light one, could not be read."""
    page = Checked((STOPPED, TOUCHED))._repr_html_()
    assert "background:#" not in page
    assert "color:#000" not in page
    assert "color:#fff" not in page
