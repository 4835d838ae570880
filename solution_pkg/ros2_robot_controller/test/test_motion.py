"""The decisions, without a robot."""

import math

import pytest
from ros2_robot_controller.utils.motion import (
    Command, distance_to, goal_refusal, has_arrived, Limits, make_safe, obstacle_in_way, Place,
    ramp, speed_cap, speed_refusal, speed_up_gently, steer, STOP)
from ros2_robot_controller.utils.scans import Proximity

INF, NAN = math.inf, math.nan
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


# Setting the speed

@pytest.mark.parametrize('speed', [0.0, 0.25, 0.5, -0.5, 0.5 + 1e-8])
def test_a_speed_within_the_limit_is_accepted(speed):
    assert speed_refusal(speed, 0.5) == ''


@pytest.mark.parametrize('speed', [0.5625, -0.5625, 0.5001, 1e9])
def test_a_speed_beyond_the_limit_is_refused_with_the_limit(speed):
    assert '0.5 m/s' in speed_refusal(speed, 0.5).split('limit')[1]


@pytest.mark.parametrize('speed', [NAN, INF, -INF])
def test_a_speed_that_is_no_number_is_refused_with_the_limit(speed):
    assert str(speed) in speed_refusal(speed, 0.75)
    assert '0.75 m/s' in speed_refusal(speed, 0.75)


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
    (INF, 0.5), (0.8, 0.5), (0.65, 0.25), (0.7, 1 / 3), (0.53, 0.1), (0.5, 0.1), (0.3, 0.1),
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


# Goals

@pytest.mark.parametrize(('x', 'y', 'tolerance', 'culprit'), [
    (NAN, 0.0, 0.1, '(nan, 0.0)'), (0.0, INF, 0.1, '(0.0, inf)'), (0.0, -INF, 0.1, '(0.0, -inf)'),
    (0.0, 0.0, 0.0, '0.0 m'), (0.0, 0.0, -0.1, '-0.1 m'), (0.0, 0.0, NAN, 'nan m'),
    (0.0, 0.0, INF, 'inf m'),
])
def test_a_goal_that_nobody_can_reach_is_refused_in_words(x, y, tolerance, culprit):
    assert culprit in goal_refusal(x, y, tolerance)


def test_any_other_goal_is_tried():
    assert goal_refusal(-3.0, 4.0, 0.01) == ''


def test_distance_is_the_straight_line():
    assert distance_to(Place(1.0, 2.0, 0.7), 4.0, 6.0) == pytest.approx(5.0)


@pytest.mark.parametrize(('distance', 'tolerance', 'blocked', 'expected'), [
    (0.0, 0.1, False, True), (0.049, 0.1, False, True), (0.06, 0.1, False, False),
    (0.049, 0.5, False, True), (0.06, 0.5, False, False),  # nearer than it has to be
    (0.019, 0.04, False, True), (0.021, 0.04, False, False),
    (0.45, 0.5, True, True), (0.5, 0.5, True, True), (0.51, 0.5, True, False),
    (NAN, 0.5, False, False), (NAN, 0.5, True, False),
])
def test_the_goal_is_reached_well_within_its_tolerance(distance, tolerance, blocked, expected):
    assert has_arrived(distance, tolerance, blocked) is expected


@pytest.mark.parametrize(('yaw', 'x', 'y', 'v', 'omega'), [
    (0.0, 3.0, 0.0, 0.5, 0.0),  # straight ahead
    (0.0, 0.2, 0.0, 0.2, 0.0),  # slower near the goal
    (0.0, 0.0, 3.0, 0.0, 1.5 * math.pi / 2),  # to the left: turn in place, to the left
    (0.0, 0.0, -3.0, 0.0, -1.5 * math.pi / 2),
    (0.0, -3.0, 0.0, 0.0, 1.5 * math.pi),  # behind
    (3.0, -3.0, -0.3, 0.5, 1.5 * (2 * math.pi - 3.0 - math.pi + math.atan2(0.3, 3.0))),
    (0.25, 3.0, 0.0, 0.5, -1.5 * 0.25), (-0.25, 3.0, 0.0, 0.5, 1.5 * 0.25),  # an arc
    (0.35, 3.0, 0.0, 0.0, -1.5 * 0.35),
])
def test_the_robot_turns_to_the_goal_then_drives(yaw, x, y, v, omega):
    command = steer(Place(0.0, 0.0, yaw), x, y, LIMITS)
    assert (command.v, command.omega) == pytest.approx((v, omega))


def test_the_way_starts_where_the_robot_is():
    command = steer(Place(1.0, 2.0, math.pi / 2), 1.0, 2.25, LIMITS)
    assert (command.v, command.omega) == pytest.approx((0.25, 0.0))
