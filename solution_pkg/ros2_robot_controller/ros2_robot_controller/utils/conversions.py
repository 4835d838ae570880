"""Turn angles and quaternions into each other. Numbers only: no node, no topics."""

import math

from geometry_msgs.msg import Quaternion


def yaw_from_quaternion(q: Quaternion) -> float:
    """
    Return the rotation about z in radians, in (-pi, pi].

    Any length of quaternion will do; the all-zero one, which means nothing, reads 0.
    """
    sine = 2.0 * (q.w * q.z + q.x * q.y)
    # The textbook has 1 - 2 (y² + z²) here, which holds for length 1 only.
    cosine = q.w * q.w + q.x * q.x - q.y * q.y - q.z * q.z
    return normalize_angle(math.atan2(sine, cosine))


def quaternion_from_yaw(yaw: float) -> Quaternion:
    """Return the unit quaternion of a rotation by `yaw` radians about z."""
    return Quaternion(x=0.0, y=0.0, z=math.sin(yaw / 2.0), w=math.cos(yaw / 2.0))


def normalize_angle(angle: float) -> float:
    """
    Return the same direction in radians, in (-pi, pi].

    What is no direction, NaN or infinity, reads NaN.
    """
    if not math.isfinite(angle):
        return math.nan
    wrapped = math.remainder(angle, math.tau)  # in [-pi, pi], so one end is left to fold over
    return math.pi if wrapped == -math.pi else wrapped


def clamp(value: float, low: float, high: float) -> float:
    """Return `value`, or the nearer end where it lies outside [low, high]; NaN stays NaN."""
    if value < low:
        return low
    if value > high:
        return high
    return value
