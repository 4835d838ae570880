"""The way to a goal, without a robot."""

import math

from geometry_msgs.msg import Pose
import pytest
from ros2_robot_controller.utils.conversions import quaternion_from_yaw
from ros2_robot_controller.utils.motion import Limits
from ros2_robot_controller.utils.steering import (
    distance_to, goal_refusal, has_arrived, Place, place_of, steer)

INF, NAN = math.inf, math.nan
LIMITS = Limits(
    max_linear_speed=0.5, max_angular_speed=1.0, linear_acceleration=1.0,
    angular_acceleration=2.0, obstacle_detection_threshold=0.5, emergency_stop_distance=0.2,
    safety_margin=0.3)


def test_a_place_is_what_matters_of_a_pose():
    pose = Pose(orientation=quaternion_from_yaw(0.5))
    pose.position.x, pose.position.y, pose.position.z = 1.0, 2.0, 3.0
    place = place_of(pose)
    assert (place.x, place.y, place.yaw) == pytest.approx((1.0, 2.0, 0.5))


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
