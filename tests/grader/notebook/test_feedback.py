"""The answer of a check, as text and as HTML."""

from __future__ import annotations

from grader.notebook.feedback import Answer, Checked, Note, Table
from grader.report.figures import Picture

SEEN = Note("", (("seen", "touched the wall at 7.3 s"), ("expected", "never touches it"), ("try", "look ahead")))
STOPPED = Answer("F4", "Stops", "5", "5", passed=True)
TOUCHED = Answer("F4", "Stops", "2", "5", passed=False, notes=(SEEN,), section="Taught in notebook 05.")


def test_a_passed_requirement_takes_one_line() -> None:
    assert repr(Checked((STOPPED,))) == "F4 passed (5 of 5)"


def test_a_verdict_by_a_sample_says_so_where_it_gives_the_points() -> None:
    """T3 said "passed (6 of 6)" after ten of 51 mutants."""
    answer = Answer("T3", "Tests that notice", "6", "6", passed=True, sample="a sample: 10 of 51 mutants tried")
    assert repr(Checked((answer,))) == "T3 passed (6 of 6; a sample: 10 of 51 mutants tried)"


def test_a_failed_requirement_has_seen_expected_and_try() -> None:
    assert repr(Checked((TOUCHED,))).splitlines() == [
        "F4 not yet (2 of 5)",
        "    seen      touched the wall at 7.3 s",
        "    expected  never touches it",
        "    try       look ahead",
    ]


def test_several_findings_have_headings() -> None:
    other = Note("`cmd_vel` comes at 10 Hz.", (("seen", "2 Hz"),))
    said = repr(Checked((Answer("F1", "Idle", "0", "3", False, notes=(SEEN, other)),)))
    assert "\n  `cmd_vel` comes at 10 Hz.\n    seen      2 Hz" in said


def test_long_lines_are_wrapped_and_line_breaks_kept() -> None:
    note = Note("", (("seen", "not found:\n" + "word " * 40),))
    lines = repr(Checked((Answer("Q5", "README", "0", "3", False, notes=(note,)),))).splitlines()
    assert lines[1] == "    seen      not found:"
    assert all(len(line) <= 100 for line in lines)
    assert lines[2].startswith("              word")


def test_points_and_passed_are_for_programs() -> None:
    assert Checked((STOPPED, TOUCHED)).points == 7.0
    assert not Checked((STOPPED, TOUCHED)).passed
    assert Checked((STOPPED,)).passed


def test_an_error_of_the_kit_is_neither_passed_nor_failed() -> None:
    ours = Answer("F1", "Idle", "0", "3", passed=False, ours=True)
    assert repr(Checked((ours,))) == "F1 could not be judged"
    assert not Checked((ours,)).passed


def test_the_page_is_self_contained_and_escaped() -> None:
    note = Note("", (("seen", "<script>alert(1)</script> and `min([])`"),))
    picture = Picture("obstacle", "data:image/png;base64,AA", 'The "robot" went')
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


def test_a_table_unfolds_on_the_page() -> None:
    table = Table("All 2 mutants", ("noticed by", "place"), (("✓ test_a", "a.py:7"), ("no test", "a.py:9 `<b>`")))
    page = Checked((STOPPED,), tables=(table,))._repr_html_()
    assert "<summary style=" in page
    assert ">All 2 mutants</summary>" in page
    assert page.count("<tr ") == 3
    assert "<code>&lt;b&gt;</code>" in page
