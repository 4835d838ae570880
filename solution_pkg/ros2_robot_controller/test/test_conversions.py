"""Angles and quaternions, at their edges."""

import math

from geometry_msgs.msg import Quaternion
import pytest
from ros2_robot_controller.utils.conversions import (
    clamp, normalize_angle, quaternion_from_yaw, yaw_from_quaternion)

PI = math.pi


@pytest.mark.parametrize(('angle', 'expected'), [
    (0.0, 0.0), (1.0, 1.0), (-1.0, -1.0),
    (PI, PI), (-PI, PI), (3 * PI, PI), (-3 * PI, PI),
    (PI + 0.1, 0.1 - PI), (-PI - 0.1, PI - 0.1), (2 * PI, 0.0), (100 * PI + 0.5, 0.5),
])
def test_an_angle_is_turned_into_the_half_open_circle(angle, expected):
    assert normalize_angle(angle) == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize('angle', [math.nan, math.inf, -math.inf])
def test_what_is_no_direction_stays_none(angle):
    assert math.isnan(normalize_angle(angle))


@pytest.mark.parametrize('yaw', [0.0, 0.3, -0.3, PI / 2, -PI / 2, 3.1, -3.1, PI])
def test_yaw_survives_the_way_there_and_back(yaw):
    assert yaw_from_quaternion(quaternion_from_yaw(yaw)) == pytest.approx(yaw)


def test_minus_pi_comes_back_as_pi():
    assert yaw_from_quaternion(quaternion_from_yaw(-PI)) == pytest.approx(PI)


def test_a_quarter_turn_is_the_quaternion_of_the_textbook():
    q = quaternion_from_yaw(PI / 2)
    assert (q.x, q.y, q.z, q.w) == pytest.approx((0.0, 0.0, math.sqrt(0.5), math.sqrt(0.5)))


def test_the_length_of_the_quaternion_does_not_matter():
    q = quaternion_from_yaw(2.0)
    longer = Quaternion(x=3 * q.x, y=3 * q.y, z=3 * q.z, w=3 * q.w)
    assert yaw_from_quaternion(longer) == pytest.approx(2.0)


def test_the_all_zero_quaternion_reads_zero():
    assert yaw_from_quaternion(Quaternion(x=0.0, y=0.0, z=0.0, w=0.0)) == 0.0


def test_roll_and_pitch_do_not_change_the_yaw():
    """Yaw 0.7, pitch 0.4, roll 0.2, multiplied out by hand: q = q_yaw * q_pitch * q_roll."""
    cy, sy = math.cos(0.35), math.sin(0.35)
    cp, sp = math.cos(0.2), math.sin(0.2)
    cr, sr = math.cos(0.1), math.sin(0.1)
    q = Quaternion(
        w=cr * cp * cy + sr * sp * sy, x=sr * cp * cy - cr * sp * sy,
        y=cr * sp * cy + sr * cp * sy, z=cr * cp * sy - sr * sp * cy)
    assert yaw_from_quaternion(q) == pytest.approx(0.7)


@pytest.mark.parametrize(('value', 'expected'), [
    (-3.0, -1.0), (-1.0, -1.0), (0.5, 0.5), (2.0, 2.0), (7.0, 2.0), (math.inf, 2.0),
])
def test_clamp_keeps_to_both_ends(value, expected):
    assert clamp(value, -1.0, 2.0) == expected


def test_clamp_does_not_hide_a_nan():
    assert math.isnan(clamp(math.nan, -1.0, 2.0))
