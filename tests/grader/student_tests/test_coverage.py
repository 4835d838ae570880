"""Coverage's data is checked against what the tests were reported to reach."""

from __future__ import annotations

from grader.student_tests.coverage import unexplained

PATH = "ros2_robot_controller/a.py"
TEXT = "import x\n\n\ndef f(a,\n      b):\n    c = (a +\n         b)\n    if c:\n        return 1\n    return 2\n"


def reach(*lines: int) -> dict[int, frozenset[str]]:
    return {line: frozenset({"test/test_it.py::test_it"}) for line in lines}


def test_lines_that_a_run_reported_are_explained():
    assert unexplained(PATH, TEXT, [1, 4, 6, 8], [reach(1, 4), reach(6, 8)]) == []


def test_a_statement_of_several_lines_may_be_reported_by_any_of_them():
    assert unexplained(PATH, TEXT, [1, 4, 6], [reach(1, 5, 7)]) == []


def test_a_line_that_no_run_reported_is_doubted():
    assert unexplained(PATH, TEXT, [1, 4, 8, 9], [reach(1, 4, 8)]) == [
        "ros2_robot_controller/a.py: line 9 is in coverage's data, yet no test was reported to reach it"
    ]
