"""What a terminal shows of a grading."""

import io
import re
from dataclasses import replace

import pytest
from helpers.report_examples import BUILD, CHOSEN, INTAKE, TOUCHED, grading, results

from grader.evidence import Evidence
from grader.report import console, html
from grader.scoring.scorecard import CheckResult, Outcome


def test_a_failure_is_told_in_seen_expected_and_try(rubric):
    text = console.render(grading(rubric, results(rubric, TOUCHED)))
    expected = """\
FAILED  F4  never touches the obstacle (3 of 3 points lost)
        seen      touched the wall ahead at 4.9 s sim time, x = 1.83 m, moving at 0.40 m/s
        expected  no contact for the whole trial
        try       which beam points straight ahead? compare `angle_min` with the scan's first range
        learn     notebook 05_moving_safely, section "Stop before the wall"
"""
    assert expected in text


def test_the_table_shows_criteria_and_requirements(rubric):
    text = console.render(grading(rubric, results(rubric, TOUCHED)))
    expected = """\
team07.zip: package ros2_robot_controller

Functionality            5 / 8    ############........  C
  PARTIAL      F4   Stops before an obstacle               2 / 5
  passed       F8   Reaches a target                       3 / 3

Testing              to be graded by a person (4 points)
"""
    assert text.startswith(expected)


def test_the_packages_that_were_not_graded_and_the_reason_come_first(rubric):
    text = console.render(grading(rubric, results(rubric), Evidence(CHOSEN, BUILD)))
    assert text.startswith("""\
team07.zip: package ros2_robot_controller
  graded: ws/src/ctl, because its folder bears its name
  not graded: old (ros2_robot_controller)
  `--package-path PATH` grades another
  note: Opened a.zip inside.
  note: y.rar was not opened: the grader opens zip and tar only.
""")


def test_the_end_says_how_much_is_graded_so_far(rubric):
    text = console.render(grading(rubric, results(rubric)))
    end = "Points    8 of 8 graded so far; 12 when all is\n          2 of 3 requirements are graded so far"
    assert text.endswith(end)


def test_an_error_of_ours_says_that_it_costs_nothing_and_that_the_grade_is_incomplete(rubric):
    text = console.render(grading(rubric, results(rubric)[1:]))
    assert "ERROR  F4" in text
    assert "an error of the grader: costs no points" in text
    assert "Incomplete: an error of the grader left F4 without a full verdict." in text


def test_what_was_not_reached_for_one_reason_is_told_once(rubric):
    waits = [CheckResult(c.id, Outcome.NOT_REACHED, 0, because="the package does not build") for c in rubric.checks]
    text = console.render(grading(rubric, waits))
    assert text.lower().count("the package does not build") == 1
    assert text.startswith("""\
team07.zip: package ros2_robot_controller
First cause: The package does not build; 8 points follow from it
""")
    assert "not reached  F4, F8\n        because   of the first cause, above" in text


def test_what_to_do_about_a_check_that_was_not_reached_is_said_once(rubric):
    waits = [
        CheckResult(check.id, Outcome.NOT_REACHED, 0, because="a callback spins", try_="`await` it")
        for check in rubric.checks
        if check.id.startswith("check_obstacle")
    ]
    made = grading(rubric, results(rubric, *waits))
    assert len(waits) > 1
    assert "not reached  F4\n        because   a callback spins\n        try       `await` it\n" in console.render(made)
    assert html.render(made).count("<dt>try</dt><dd><code>await</code> it</dd>") == 1


def test_points_have_two_decimals_half_up_and_add_up(rubric):
    """What is shown as lost and what is shown as reached make the whole."""
    check = next(check for check in rubric.checks if check.id == "check_navigation::test_reaches_a_target")
    part = CheckResult(check.id, Outcome.PARTIAL, 0.335)
    text = console.render(grading(rubric, results(rubric, part)))
    assert check.points == 3
    assert "PARTIAL      F8   Reaches a target                    1.01 / 3" in text
    assert "(1.99 of 3 points lost)" in text


def test_a_loss_below_a_tenth_of_a_point_is_shown_and_not_taken(rubric):
    """What cost most of an excellent package were crumbs: 0.06 of Q1, for one finding in 1200 lines."""
    nearly = CheckResult("check_navigation::test_reaches_a_target", Outcome.PARTIAL, 0.97, seen="a centimetre off")
    made = grading(rubric, results(rubric, nearly))
    text = console.render(made)
    assert re.search(r"passed +F8 +Reaches a target +3 / 3", text)
    assert "a centimetre off" in text
    assert "0.09 points; a loss below 0.1 of a requirement is shown and not taken" in text
    assert made.losses == ()


def test_a_student_cannot_fake_lines_or_colours(rubric):
    """Escapes are spelt out and a second line of "seen" stays in its column."""
    fake = replace(TOUCHED, seen="x\x1b[2J\nPoints    8 of 8\r\x1b]0;t\x07")
    intake = replace(INTAKE, package="pkg\nPoints    100 of 100")
    text = console.render(grading(rubric, results(rubric, fake), Evidence(intake, BUILD)), colour=True)
    assert set(re.findall(r"\x1b\[?[^m]*m?", text)) <= {f"\x1b[{code}m" for code in (0, 2, 31, 32, 33, 35, 36)}
    assert [line for line in text.split("\n") if line.startswith("Points")] == [
        "Points    5 of 8 graded so far; 12 when all is"
    ]


def test_without_colour_the_text_is_plain(rubric):
    assert "\x1b" not in console.render(grading(rubric, results(rubric, TOUCHED)))


def test_no_line_is_wider_than_asked(rubric):
    wide = replace(TOUCHED, seen="word " * 100 + "x" * 500, sentence="")
    text = console.render(grading(rubric, results(rubric, wide)), width=80)
    assert max(map(len, text.split("\n"))) <= 80


def test_a_terminal_that_knows_ascii_only_can_print_it(rubric):
    odd = replace(TOUCHED, seen="turned by 3° ± 1°")
    text = console.render(grading(rubric, results(rubric, odd)), encoding="ascii")
    assert r"turned by 3\xb0 \xb1 1\xb0" in text


class Terminal(io.StringIO):
    def isatty(self):
        return True


@pytest.mark.parametrize(
    ("stream", "environ", "wanted"),
    [
        (Terminal(), {}, True),
        (Terminal(), {"NO_COLOR": "1"}, False),
        (Terminal(), {"NO_COLOR": ""}, True),
        (Terminal(), {"TERM": "dumb"}, False),
        (io.StringIO(), {}, False),
    ],
)
def test_colour_is_for_terminals_whose_owner_wants_it(stream, environ, wanted):
    assert console.wants_colour(stream, environ) is wanted
