"""Decide how to move: limits, ramps, the safe speed, the way to a goal. No node, no topics."""

from dataclasses import dataclass
import math

from ros2_robot_controller.utils.conversions import clamp, normalize_angle
from ros2_robot_controller.utils.scans import Proximity

FACING_RAD = 0.3  # turn in place until the goal is this near to straight ahead
TURN_GAIN = 1.5  # rad/s per rad: well below 1 / (control period + sensor delay), so no overshoot
APPROACH_GAIN = 1.0  # m/s per m: from here on the speed falls with the distance left
ARRIVAL_M = 0.05  # drive on to this near if allowed: odometry drifts, the tolerance does not
ARRIVAL_SHARE = 0.5  # and never use up more than this share of the tolerance
MIN_SPEED_SHARE = 0.2  # of max_linear_speed, near an obstacle: slow, yet sure to reach the edge
FLOAT32_SLACK = 1e-6  # 0.3 arrives in a float32 message as 0.30000001


@dataclass(frozen=True)
class Limits:
    """What the robot may do, in SI units; the fields are the node's parameters."""

    max_linear_speed: float
    max_angular_speed: float
    linear_acceleration: float
    angular_acceleration: float
    obstacle_detection_threshold: float
    emergency_stop_distance: float
    safety_margin: float


@dataclass(frozen=True)
class Command:
    """A velocity: v in m/s forward, omega in rad/s counter-clockwise."""

    v: float = 0.0
    omega: float = 0.0


STOP = Command()


@dataclass(frozen=True)
class Place:
    """Where the robot is in the odom frame: x, y in metres, yaw in radians."""

    x: float
    y: float
    yaw: float


def speed_refusal(speed: float, limit: float) -> str:
    """Return why `speed` may not be set, in words that state the limit; empty if it may."""
    if not math.isfinite(speed):
        return f'a speed of {speed} is no number to drive at, the limit is {limit:.3g} m/s'
    if abs(speed) > limit * (1.0 + FLOAT32_SLACK):
        return f'{speed:.3g} m/s is beyond the limit of {limit:.3g} m/s'
    return ''


def ramp(previous: float, wanted: float, largest_rise: float) -> float:
    """
    Return the next value on the way to `wanted`; its size grows by at most `largest_rise`.

    Slowing down is free. Turning round passes through a moment of exactly zero.
    """
    if previous * wanted < 0.0:
        return 0.0
    return math.copysign(min(abs(wanted), abs(previous) + largest_rise), wanted)


def speed_up_gently(previous: Command, wanted: Command, dt: float, limits: Limits) -> Command:
    """Return `wanted` as far as the accelerations let the robot get there within dt seconds."""
    return Command(
        v=ramp(previous.v, wanted.v, limits.linear_acceleration * dt),
        omega=ramp(previous.omega, wanted.omega, limits.angular_acceleration * dt),
    )


def obstacle_in_way(near: Proximity, v: float, limits: Limits) -> bool:
    """Return whether something keeps the robot from driving as v points (0 means forward)."""
    if near.anywhere < limits.emergency_stop_distance:
        return True
    return clearance(near, v) < limits.obstacle_detection_threshold


def clearance(near: Proximity, v: float) -> float:
    """Return the closest reading in the direction of travel in metres (0 means forward)."""
    return near.behind if v < 0.0 else near.ahead


def speed_cap(distance: float, limits: Limits) -> float:
    """Return the highest speed at this distance of an obstacle, in m/s, never 0."""
    room = distance - limits.obstacle_detection_threshold
    if room >= limits.safety_margin:
        return limits.max_linear_speed
    share = room / limits.safety_margin if room > 0.0 else 0.0
    return limits.max_linear_speed * max(MIN_SPEED_SHARE, share)


def make_safe(wanted: Command, near: Proximity, limits: Limits) -> Command:
    """
    Return `wanted`, slowed down or stopped as the obstacles demand, and within the limits.

    Too close in any direction stops everything. An obstacle in the way stops driving, so turning
    in place towards a goal goes on.
    """
    if near.anywhere < limits.emergency_stop_distance:
        return STOP
    if wanted.v != 0.0 and obstacle_in_way(near, wanted.v, limits):
        return STOP
    cap = speed_cap(clearance(near, wanted.v), limits)
    return Command(
        v=clamp(wanted.v, -cap, cap),
        omega=clamp(wanted.omega, -limits.max_angular_speed, limits.max_angular_speed),
    )


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
