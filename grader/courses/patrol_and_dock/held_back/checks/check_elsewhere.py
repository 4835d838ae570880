"""P4: the robot visits the places of a building that students have not seen."""

from grader.checks.judge import Judge
from grader.courses.patrol_and_dock.checks.check_patrol import expect_a_round


def test_visits_every_place_of_the_stores(judge: Judge) -> None:
    """The robot visits the places of another building."""
    expect_a_round(judge, "round_of_the_stores")
