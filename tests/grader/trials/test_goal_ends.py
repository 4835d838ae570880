"""A goal ends in the tick in which the node ends it, however slowly node and observer get on with it."""

from __future__ import annotations

import pytest
from helpers import beside
from helpers.short_nodes import ODOMETRY, Run

TEXTS = beside(__file__)

pytestmark = [pytest.mark.ros, pytest.mark.sandbox]


@pytest.mark.slow  # one more trial
def test_a_result_that_the_node_is_long_in_sending_counts_for_the_tick_of_its_timer(run: Run):
    """The node sleeps between the round of its executor that ends the goal and the message that tells us."""
    found = run("cancel_early", ODOMETRY + TEXTS["ROLLS_ON"])
    (goal,) = found.goals
    (ending,) = [command.t for command in found.commands if command.omega]
    assert (goal.status, goal.ended_t) == ("canceled", ending)
    assert goal.cancel_t < ending
