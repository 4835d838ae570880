"""Values that make no sense, and those at the edge of it."""

import math

import pytest
from rclpy.parameter import Parameter
from ros2_robot_controller.utils import settings


@pytest.mark.parametrize(('setting', 'good', 'bad'), [
    (settings.at_least_zero(1.0), [0.0, 2.5], [-0.1, math.nan, math.inf]),
    (settings.above_zero(1.0), [0.01, 2.5], [0.0, -0.1, math.nan, math.inf]),
    (settings.rate(1.0), [0.1, 10.0, 1000.0], [0.0, -1.0, 1000.1, math.nan, math.inf]),
    (settings.percentage(1.0), [0.0, 50.0, 100.0], [-0.1, 100.1, math.nan]),
    (settings.name('robot'), ['turtlebot4'], ['', '  ']),
])
def test_a_setting_tells_sense_from_nonsense(setting, good, bad):
    assert [setting.is_sensible(value) for value in good] == [True] * len(good)
    assert [setting.is_sensible(value) for value in bad] == [False] * len(bad)


def test_a_refusal_names_the_parameter_the_rule_and_the_value():
    known = {'depth': settings.at_least_zero(1.0), 'pace': settings.rate(5.0)}
    parameters = [Parameter('depth', value=1.0), Parameter('pace', value=-2.0)]
    assert settings.first_refusal(known, parameters) == (
        'pace must be above 0 and at most 1000 Hz, not -2.0')


def test_parameters_of_others_pass():
    assert settings.first_refusal({}, [Parameter('use_sim_time', value=True)]) == ''


@pytest.mark.parametrize('setting', [
    settings.at_least_zero(3.0), settings.above_zero(3.0), settings.rate(3.0),
    settings.percentage(3.0),
])
def test_a_setting_has_its_default_and_says_what_it_wants(setting):
    assert setting.default == 3.0
    assert setting.must_be
