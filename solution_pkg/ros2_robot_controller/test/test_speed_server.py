"""The speeds that are refused, without a robot."""

import math

import pytest
from ros2_robot_controller.speed_server import speed_refusal


@pytest.mark.parametrize('speed', [0.0, 0.25, 0.5, -0.5, 0.5 + 1e-8])
def test_a_speed_within_the_limit_is_accepted(speed):
    assert speed_refusal(speed, 0.5) == ''


@pytest.mark.parametrize('speed', [0.5625, -0.5625, 0.5001, 1e9])
def test_a_speed_beyond_the_limit_is_refused_with_the_limit(speed):
    assert '0.5 m/s' in speed_refusal(speed, 0.5).split('limit')[1]


@pytest.mark.parametrize('speed', [math.nan, math.inf, -math.inf])
def test_a_speed_that_is_no_number_is_refused_with_the_limit(speed):
    assert str(speed) in speed_refusal(speed, 0.75)
    assert '0.75 m/s' in speed_refusal(speed, 0.75)
