"""Decide how to move safely: limits, ramps, obstacles. No node, no topics."""

from dataclasses import dataclass
import math

from ros2_robot_controller.utils.conversions import clamp
from ros2_robot_controller.utils.scans import Proximity

MIN_SPEED_SHARE = 0.2  # of max_linear_speed, near an obstacle: slow, yet sure to reach the edge


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
