"""Text that a submission had a hand in."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from grader.sanitize import LINE_LIMIT, TEXT_LIMIT, lines, one_line


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("plain", "plain"),
        ("Müller × 5 µs 日本", "Müller × 5 µs 日本"),
        ("red \x1b[31m", r"red \x1b[31m"),
        ("link \x1b]8;;http://x\x07", r"link \x1b]8;;http://x\x07"),
        ("C1 \x9b31m", r"C1 \x9b31m"),
        ("gpj\u202eexe.", r"gpj\u202eexe."),
        ("isolate\u2066", r"isolate\u2066"),
        ("zero\u200bwidth", r"zero\u200bwidth"),
        ("tag\U000e0041", r"tag\U000e0041"),
        ("half \ud800", r"half \ud800"),
        ("two\nlines\r", r"two\nlines\r"),
        ("line\u2028separator", r"line\u2028separator"),
        ("z\u0301\u0301\u0301\u0301\u0301", "z\u0301\u0301\u0301\\u0301\\u0301"),
    ],
)
def test_what_cannot_be_seen_is_spelt_out(text, shown):
    assert one_line(text) == shown


def test_line_breaks_are_kept_where_a_text_may_have_lines():
    assert lines("one\r\n\ttwo\x1b[A\nthree\rfake") == "one\n    two\\x1b[A\nthree\\rfake"


def test_a_long_line_says_how_much_was_cut():
    assert one_line("x" * 1234, limit=10) == "xxxxxxxxxx … (1,224 characters more)"


def test_of_a_log_the_end_is_kept():
    shown = lines("x\n" * 100_000 + "error: the last line", tail=True)
    assert shown.endswith("error: the last line")
    assert shown.startswith("(192,020 characters more) … ")


@given(st.text(st.characters(), max_size=300))
def test_whatever_comes_in_what_comes_out_is_short_and_visible(text):
    shown = lines(text * 50)
    blanks = "\xa0\u1680\u2000\u2001\u2002\u2003\u2004\u2005\u2006\u2007\u2008\u2009\u200a\u202f\u205f\u3000"
    assert all(line.translate(dict.fromkeys(map(ord, blanks), " ")).isprintable() for line in shown.split("\n"))
    assert not any(character in shown for character in "\x1b\x07\x9b\r\u202e\u2066\u200b\u2028")
    assert len(shown) <= 10 * TEXT_LIMIT + 100
    assert all(len(line) <= 10 * LINE_LIMIT + 100 for line in shown.split("\n"))
