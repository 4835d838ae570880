"""Q3: the conversions in their place."""

from grader.checks.check_structure import expect_functions_used
from grader.checks.judge import Judge


def test_conversions_are_in_utils_and_used(judge: Judge) -> None:
    """The conversions are in `utils/`, and the nodes use them instead of converting by hand."""
    expect_functions_used(judge)
