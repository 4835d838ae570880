"""What is safe, without a robot."""

import math

import pytest
from ros2_robot_controller.utils.motion import (
    Command, Limits, make_safe, obstacle_in_way, ramp, speed_cap, speed_up_gently, STOP)
from ros2_robot_controller.utils.scans import Proximity

LIMITS = Limits(
    max_linear_speed=0.5, max_angular_speed=1.0, linear_acceleration=1.0,
    angular_acceleration=2.0, obstacle_detection_threshold=0.5, emergency_stop_distance=0.2,
    safety_margin=0.3)
FREE = Proximity()
FORWARD, BACKWARD, TURN = Command(v=0.4), Command(v=-0.4), Command(omega=0.8)


def wall_ahead(distance):
    return Proximity(ahead=distance, anywhere=distance)


def wall_behind(distance):
    return Proximity(behind=distance, anywhere=distance)


# Ramps

@pytest.mark.parametrize(('previous', 'wanted', 'expected'), [
    (0.0, 0.5, 0.1), (0.2, 0.5, 0.3), (0.0, -0.5, -0.1), (-0.2, -0.5, -0.3),  # speeding up
    (0.45, 0.5, 0.5), (-0.45, -0.5, -0.5), (0.3, 0.3, 0.3),  # there
    (0.5, 0.2, 0.2), (-0.5, -0.2, -0.2), (0.5, 0.0, 0.0),  # braking is free
    (0.5, -0.5, 0.0), (-0.5, 0.5, 0.0),  # turning round passes through zero
])
def test_a_ramp_limits_speeding_up_only(previous, wanted, expected):
    assert ramp(previous, wanted, 0.1) == pytest.approx(expected)


def test_each_ramp_has_its_own_acceleration():
    """After 0.1 s at 1 m/s² and 2 rad/s²."""
    command = speed_up_gently(STOP, Command(v=0.5, omega=-1.0), 0.1, LIMITS)
    assert (command.v, command.omega) == pytest.approx((0.1, -0.2))


def test_a_ramp_goes_on_from_the_last_command():
    command = speed_up_gently(Command(0.3, 0.4), Command(0.5, 1.0), 0.1, LIMITS)
    assert (command.v, command.omega) == pytest.approx((0.4, 0.6))


# Obstacles

@pytest.mark.parametrize(('near', 'v', 'expected'), [
    (FREE, 0.4, False), (wall_ahead(0.49), 0.4, True), (wall_ahead(0.5), 0.4, False),
    (wall_ahead(0.49), 0.0, True), (wall_ahead(0.49), -0.4, False),
    (wall_behind(0.49), 0.4, False), (wall_behind(0.49), 0.0, False),
    (wall_behind(0.49), -0.4, True), (wall_behind(0.5), -0.4, False),
    (wall_behind(0.19), 0.4, True), (wall_behind(0.2), 0.4, False),  # too close anywhere
    (Proximity(anywhere=0.19), 0.0, True),
])
def test_an_obstacle_is_what_lies_in_the_direction_of_travel(near, v, expected):
    assert obstacle_in_way(near, v, LIMITS) is expected


def test_nothing_in_the_way_changes_nothing():
    assert make_safe(Command(0.5, -0.7), FREE, LIMITS) == Command(0.5, -0.7)


@pytest.mark.parametrize(('wanted', 'near', 'expected'), [
    (FORWARD, wall_ahead(0.49), STOP), (BACKWARD, wall_ahead(0.49), BACKWARD),
    (FORWARD, wall_behind(0.49), FORWARD), (BACKWARD, wall_behind(0.49), STOP),
    (Command(0.4, 0.4), wall_ahead(0.49), STOP),
    (TURN, wall_ahead(0.49), TURN),
    (TURN, wall_ahead(0.19), STOP), (TURN, wall_behind(0.19), STOP),
    (BACKWARD, wall_ahead(0.19), STOP), (TURN, wall_behind(0.2), TURN),
])
def test_an_obstacle_stops_driving_and_a_too_close_one_everything(wanted, near, expected):
    assert make_safe(wanted, near, LIMITS) == expected


@pytest.mark.parametrize(('wanted', 'expected'), [
    (Command(2.0, 3.0), Command(0.5, 1.0)), (Command(-2.0, -3.0), Command(-0.5, -1.0)),
])
def test_the_limits_hold(wanted, expected):
    assert make_safe(wanted, FREE, LIMITS) == expected


@pytest.mark.parametrize(('distance', 'expected'), [
    (math.inf, 0.5), (0.8, 0.5), (0.65, 0.25), (0.7, 1 / 3), (0.53, 0.1), (0.5, 0.1), (0.3, 0.1),
])
def test_the_speed_falls_within_the_margin_but_never_to_nothing(distance, expected):
    assert speed_cap(distance, LIMITS) == pytest.approx(expected)


def test_the_robot_slows_down_in_either_direction():
    assert make_safe(FORWARD, wall_ahead(0.65), LIMITS).v == pytest.approx(0.25)
    assert make_safe(BACKWARD, wall_behind(0.65), LIMITS).v == pytest.approx(-0.25)


def test_no_margin_is_a_margin_too():
    limits = Limits(**{**LIMITS.__dict__, 'safety_margin': 0.0})
    assert speed_cap(0.5, limits) == 0.5
    assert make_safe(TURN, wall_ahead(0.3), limits) == TURN
    assert make_safe(FORWARD, wall_ahead(0.51), limits) == FORWARD
