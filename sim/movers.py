"""Where a moving obstacle is on its path. The simulator stops it at the hull."""

from __future__ import annotations

import itertools
import math

from sim.geometry import Point
from sim.obstacles import Obstacle, Path


class Mover:
    """The motion of one obstacle; x, y is the current position of its centre (m, map frame)."""

    def __init__(self, obstacle: Obstacle, motion: Path, has_started: bool = False) -> None:
        self.x, self.y = obstacle.pose.x, obstacle.pose.y
        self._motion = motion
        self.has_started = has_started
        self._travelled = 0.0
        self._before = 0.0  # metres travelled before the last step
        self._last_step = 0.0
        self._route = _Route((self.x, self.y), motion)

    def hear(self, event: str) -> None:
        """Start, if this is the event that the motion waits for."""
        self.has_started = self.has_started or self._motion.starts == event

    def advance(self, dt: float, now: float, robot_x: float, robot_y: float) -> float:
        """Move on by dt seconds, given the time (s) and the robot's position; return the distance moved in metres."""
        motion = self._motion
        distance = math.hypot(robot_x - self.x, robot_y - self.y)
        if not self.has_started:
            if isinstance(motion.starts, str) or now < motion.starts:
                return 0.0
            if motion.wakes_within is not None and not distance <= motion.wakes_within:
                return 0.0
            self.has_started = True
        self._before = self._travelled
        if motion.yields_within is not None and distance <= motion.yields_within:
            return 0.0
        self._last_step = motion.speed * dt
        self._travelled += self._last_step
        before = (self.x, self.y)
        self.x, self.y = self._route.at(self._travelled)
        return math.dist(before, (self.x, self.y))

    def hold(self, part: float) -> None:
        """Undo the last `advance` except for a part of it (0 to 1), because something is in the way."""
        self._travelled = self._before + part * self._last_step
        self.x, self.y = self._route.at(self._travelled)


class _Route:
    """A polyline, parametrised by arc length."""

    def __init__(self, begin: Point, path: Path) -> None:
        corners = [begin, *path.waypoints]
        if path.repeat == "back_and_forth":
            corners += corners[-2::-1]
        elif path.repeat == "loop":
            corners.append(begin)
        self._repeats = path.repeat != "once"
        self._corners = corners
        self._ends = [0.0]
        for a, b in itertools.pairwise(corners):
            self._ends.append(self._ends[-1] + math.dist(a, b))

    def at(self, travelled: float) -> Point:
        """Return the position after `travelled` metres."""
        length = self._ends[-1]
        if length == 0.0 or (travelled >= length and not self._repeats):
            return self._corners[-1]
        s = travelled % length if self._repeats else travelled
        leg = next(i for i, end in enumerate(self._ends[1:]) if s < end or i == len(self._ends) - 2)
        along = (s - self._ends[leg]) / (self._ends[leg + 1] - self._ends[leg] or 1.0)
        a, b = self._corners[leg], self._corners[leg + 1]
        return a[0] + along * (b[0] - a[0]), a[1] + along * (b[1] - a[1])
