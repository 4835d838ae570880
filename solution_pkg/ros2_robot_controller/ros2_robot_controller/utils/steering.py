"""Decide how to get to a goal. No node, no topics; what is safe is decided in utils.motion."""

from dataclasses import dataclass
import math

from geometry_msgs.msg import Pose
from ros2_robot_controller.utils.conversions import normalize_angle, yaw_from_quaternion
from ros2_robot_controller.utils.motion import Command, Limits

FACING_RAD = 0.3  # turn in place until the goal is this near to straight ahead
TURN_GAIN = 1.5  # rad/s per rad: well below 1 / (control period + sensor delay), so no overshoot
APPROACH_GAIN = 1.0  # m/s per m: from here on the speed falls with the distance left
ARRIVAL_M = 0.05  # drive on to this near if allowed: odometry drifts, the tolerance does not
ARRIVAL_SHARE = 0.5  # and never use up more than this share of the tolerance


@dataclass(frozen=True)
class Place:
    """Where the robot is in the odom frame: x, y in metres, yaw in radians."""

    x: float
    y: float
    yaw: float


def place_of(pose: Pose) -> Place:
    """Return the place in a message's pose."""
    return Place(pose.position.x, pose.position.y, yaw_from_quaternion(pose.orientation))


def goal_refusal(x: float, y: float, tolerance: float) -> str:
    """Return why nobody can drive to (x, y) within `tolerance`; empty if one can try."""
    if not (math.isfinite(x) and math.isfinite(y)):
        return f'the target ({x}, {y}) is no place'
    if not 0.0 < tolerance < math.inf:
        return f'a tolerance of {tolerance} m cannot be met'
    return ''


def distance_to(place: Place, x: float, y: float) -> float:
    """Return the straight distance from the robot to (x, y) in metres."""
    return math.hypot(x - place.x, y - place.y)


def has_arrived(distance: float, tolerance: float, blocked: bool) -> bool:
    """
    Return whether the goal is reached at this distance.

    Drives on to well within the tolerance, because odometry is never quite where the robot is;
    where an obstacle ends the drive, the tolerance as such will do.
    """
    if blocked:
        return distance <= tolerance
    return distance <= min(ARRIVAL_M, ARRIVAL_SHARE * tolerance)


def steer(place: Place, x: float, y: float, limits: Limits) -> Command:
    """Return the way to (x, y): turn in place until it lies ahead, then drive, slower at last."""
    error = normalize_angle(math.atan2(y - place.y, x - place.x) - place.yaw)
    if abs(error) > FACING_RAD:
        return Command(v=0.0, omega=TURN_GAIN * error)
    speed = min(limits.max_linear_speed, APPROACH_GAIN * distance_to(place, x, y))
    return Command(v=speed, omega=TURN_GAIN * error)
