"""Numbers of messages that were never floats."""

from __future__ import annotations

import math

import pytest

pytestmark = pytest.mark.ros


@pytest.mark.parametrize(
    ("value", "said"),
    [
        (5e-324, "5e-324: an int where a float is needed (write 1.0, not 1)"),
        (math.nan, "nan: a division by zero, or a negative int where a float is needed (write -1.0, not -1)"),
        (0.0, ""),
        (1e-12, ""),
        (-0.5, ""),
        (math.inf, ""),
    ],
)
def test_an_int_that_rclpy_read_as_a_float_is_told(value: float, said: str):
    """`omega=1` arrived as 5e-324, and the robot stood still without a word."""
    from sim.messages import no_float

    assert no_float(value) == said


def test_a_second_run_on_the_same_clock_has_later_stamps():
    """A node that goes on with another simulator must not see its clock go back."""
    from sim.messages import to_message
    from sim.sensors import BatteryReading

    assert to_message(BatteryReading(0.5, 1.0, 12.0, 0.1), began=7.25).header.stamp.sec == 107
