"""Mirror, rotate and shift points, poses and obstacles."""

from __future__ import annotations

from dataclasses import dataclass, replace

from sim.geometry import Point, Pose, normalize_angle
from sim.obstacles import Box, Circle, Obstacle, Path, Polygon, Wall


@dataclass(frozen=True)
class Transform:
    """Mirrors at the x axis (if `mirror`), then rotates about the origin (rad), then shifts (m)."""

    rotate: float = 0.0
    mirror: bool = False
    shift: Point = (0.0, 0.0)

    def point(self, p: Point) -> Point:
        """Return the transformed point."""
        return Pose(*self.shift, self.rotate).point_to_parent((p[0], -p[1] if self.mirror else p[1]))

    def pose(self, pose: Pose) -> Pose:
        """Return the transformed pose."""
        return Pose(*self.point((pose.x, pose.y)), self._angle(pose.yaw))

    def obstacle(self, obstacle: Obstacle) -> Obstacle:
        """Return the transformed obstacle, together with its path."""
        motion = obstacle.motion
        if isinstance(motion, Path):
            motion = replace(motion, waypoints=tuple(self.point(p) for p in motion.waypoints))
        match obstacle:
            case Wall():
                return replace(obstacle, start=self.point(obstacle.start), end=self.point(obstacle.end), motion=motion)
            case Box():
                center, yaw = self.point(obstacle.center), self._angle(obstacle.yaw)
                return replace(obstacle, center=center, yaw=yaw, motion=motion)
            case Circle():
                return replace(obstacle, center=self.point(obstacle.center), motion=motion)
            case Polygon():
                return replace(obstacle, points=tuple(self.point(p) for p in obstacle.points), motion=motion)

    def _angle(self, yaw: float) -> float:
        return normalize_angle((-yaw if self.mirror else yaw) + self.rotate)


def moved_to(obstacle: Obstacle, place: Point) -> Obstacle:
    """Return the obstacle with its centre at `place` (m, map frame); its yaw stays and its path is shifted too."""
    return Transform(shift=(place[0] - obstacle.pose.x, place[1] - obstacle.pose.y)).obstacle(obstacle)
