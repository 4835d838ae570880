"""F3: which messages state the limit."""

from __future__ import annotations

import pytest

from grader.courses.robot_controller.checks.check_set_speed import states


@pytest.mark.parametrize("said", ["0.25", "0.250", "0.250000", "0,25", ".25", "0.3", "0.2", "+/-0.25", "[-0.25, 0.25]"])
def test_a_limit_may_be_written_with_any_number_of_digits(said: str):
    assert states(f"0.375 m/s is beyond the limit of {said} m/s", 0.25)


@pytest.mark.parametrize("message", ["", "too fast", "0.375 m/s is too fast", "the limit is 0.5 m/s", "25", "0"])
def test_another_number_does_not_state_the_limit(message: str):
    assert not states(message, 0.25)
