"""Poses, twists and angles in the plane. Metres, radians, counter-clockwise positive (REP 103)."""

from __future__ import annotations

import math
from dataclasses import dataclass

Point = tuple[float, float]


def normalize_angle(angle: float) -> float:
    """Return the same angle in (-pi, pi], in rad."""
    wrapped = math.remainder(angle, math.tau)
    return math.pi if wrapped == -math.pi else wrapped


@dataclass(frozen=True)
class Pose:
    """A position and heading: x, y in metres, yaw in radians from the x axis."""

    x: float = 0.0
    y: float = 0.0
    yaw: float = 0.0

    def point_to_parent(self, point: Point) -> Point:
        """Return a point of this pose's frame in the parent frame, the one that the pose is given in."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        return (self.x + c * point[0] - s * point[1], self.y + s * point[0] + c * point[1])

    def point_from_parent(self, point: Point) -> Point:
        """Return a point of the parent frame in this pose's frame: the inverse of `point_to_parent`."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        dx, dy = point[0] - self.x, point[1] - self.y
        return (c * dx + s * dy, -s * dx + c * dy)

    def compose(self, child: Pose) -> Pose:
        """Return `child`, a pose in this pose's frame, in the parent frame."""
        x, y = self.point_to_parent((child.x, child.y))
        return Pose(x, y, normalize_angle(self.yaw + child.yaw))

    def inverse(self) -> Pose:
        """Return the parent frame as a pose in this pose's frame."""
        x, y = self.point_from_parent((0.0, 0.0))
        return Pose(x, y, normalize_angle(-self.yaw))

    def distance_to(self, other: Pose) -> float:
        """Return the straight-line distance between the two positions in metres."""
        return math.hypot(other.x - self.x, other.y - self.y)


@dataclass(frozen=True)
class Twist:
    """Forward speed v in m/s and turning speed omega in rad/s."""

    v: float = 0.0
    omega: float = 0.0


def advance(x: float, y: float, yaw: float, ds: float, dyaw: float) -> tuple[float, float, float]:
    """Return x, y, yaw after driving an arc of length ds (m) that turns by dyaw (rad); the result is exact."""
    if dyaw == 0.0:
        return x + ds * math.cos(yaw), y + ds * math.sin(yaw), yaw
    # The chord of the arc, ds * sinc(dyaw / 2), at the mean heading: accurate for tiny dyaw, where ds / dyaw is not.
    half = 0.5 * dyaw
    chord = ds * (math.sin(half) / half)
    middle = yaw + half
    yaw += dyaw
    if yaw > math.pi or yaw <= -math.pi:
        yaw = normalize_angle(yaw)
    return x + chord * math.cos(middle), y + chord * math.sin(middle), yaw
