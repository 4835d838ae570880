"""Where a source may be changed, and that a large or strange one stops nothing."""

from __future__ import annotations

import pytest
from helpers.course import COURSE
from submissions.toy import source

from grader.mutation.equivalent_mutants import equivalent_mutants
from grader.mutation.operators import mutants
from grader.mutation.source_text import parse

GUARDS = [
    "def f(a):\n    if TYPE_CHECKING:\n        return a + 1\n",
    "if TYPE_CHECKING:\n    def f(a):\n        return a + 1\n",
    "if __name__ == '__main__':\n    x = 1\nelse:\n    def f(a):\n        return a + 1\n",
    "def f(a):\n    if a or __name__:\n        return a + 1\n",
    "if __name__ != 'nobody':\n    def f(a):\n        return a + 1\n",
]


@pytest.mark.parametrize("text", GUARDS)
def test_only_a_guard_protects_its_body_from_mutation(text: str):
    assert "`+` became `-` in `a + 1`" in [change.words for change in mutants(source(text), COURSE)]


@pytest.mark.slow  # builds huge expressions
@pytest.mark.parametrize(
    "text",
    [
        "def f(a):\n    if a == 0x" + "f" * 5000 + ":\n        return 1 + a\n",
        "def f(a):\n    if a == 0:\n        return 0\n"
        + "".join(f"    elif a == {i}:\n        return {i}\n" for i in range(400)),
        "def f(a):\n    return " + " + ".join(["a"] * 900) + "\n",
    ],
    ids=["digits", "elif", "sum"],
)
def test_a_module_that_is_too_complex_for_python_stops_nothing(text: str):
    """It may have mutants or none."""
    if huge := parse("ros2_robot_controller/node.py", text):
        assert isinstance(mutants(huge, COURSE), list)
        assert isinstance(equivalent_mutants(huge), list)


INDENTED = """\
class Node:
    @staticmethod
    def text(a):
        s = \'\'\'
no indentation here
\'\'\'
        return s * a if a > 2 else s + 'x'

    limit = 3 + 4; other = 5 - 1
    rate = 7 * 2  # with a comment
"""


def test_mutants_in_methods_strings_and_lines_of_two_statements_are_found():
    words = [change.words for change in mutants(source(INDENTED), COURSE)]
    for part in ("`a > 2`", "`3 + 4`", "`5 - 1`", "`7 * 2`"):
        assert any(part in each for each in words), (part, words)
