"""The obstacles at one moment: what a lidar hits and what a hull touches. No robot, no time."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import pymunk

from sim.geometry import Point, Pose
from sim.lidar import Array, Beams, Outline, Shapes, cast
from sim.obstacles import CirclePart, Obstacle, Part, PolygonPart, SegmentPart

EVERYTHING = pymunk.ShapeFilter()


@dataclass(frozen=True)
class Nearest:
    """The nearest surface: distance in m (below 0 inside), the obstacle's name, the point on the surface."""

    distance: float
    name: str
    point: Point


class Scene:
    """Obstacles by name, which can be added, removed and moved. Distances come from pymunk, ranges from `sim.lidar`."""

    def __init__(self, obstacles: Iterable[Obstacle] = ()) -> None:
        self._space = pymunk.Space()
        self._bodies: dict[str, pymunk.Body] = {}
        self._names: dict[pymunk.Shape, str] = {}
        self._obstacles: dict[str, Obstacle] = {}
        self._shift: dict[str, Point] = {}
        self._unsynced: set[str] = set()
        self._outline: Outline | None = None
        self._shapes: Shapes | None = None
        for obstacle in obstacles:
            self.add(obstacle)

    @property
    def obstacles(self) -> tuple[Obstacle, ...]:
        """The obstacles that are present, as they were added."""
        return tuple(self._obstacles.values())

    def __contains__(self, name: str) -> bool:
        return name in self._obstacles

    def add(self, obstacle: Obstacle) -> None:
        """Add an obstacle.

        Raises:
            ValueError: an obstacle of that name is present.
        """
        if obstacle.name in self._obstacles:
            raise ValueError(
                f"an obstacle named {obstacle.name!r} is there already; remove it first or choose another name"
            )
        body = pymunk.Body(body_type=pymunk.Body.KINEMATIC if obstacle.motion else pymunk.Body.STATIC)
        body.position, body.angle = (obstacle.pose.x, obstacle.pose.y), obstacle.pose.yaw
        shapes = [_pymunk_shape(body, part) for part in obstacle.parts()]
        self._space.add(body, *shapes)
        self._bodies[obstacle.name] = body
        self._names.update(dict.fromkeys(shapes, obstacle.name))
        self._obstacles[obstacle.name] = obstacle
        self._outline = self._shapes = None

    def remove(self, name: str) -> Obstacle:
        """Remove an obstacle and return it.

        Raises:
            KeyError: there is no obstacle of that name.
        """
        if name not in self._obstacles:
            raise KeyError(f"there is no obstacle named {name!r}; there are {', '.join(self._obstacles) or 'none'}")
        body = self._bodies.pop(name)
        for shape in body.shapes:
            del self._names[shape]
            self._space.remove(shape)
        self._space.remove(body)
        self._shift.pop(name, None)
        self._unsynced.discard(name)
        self._outline = self._shapes = None
        return self._obstacles.pop(name)

    def move(self, name: str, x: float, y: float) -> None:
        """Put an obstacle's centre at x, y (m)."""
        pose = self._obstacles[name].pose
        self._shift[name] = (x - pose.x, y - pose.y)
        self._unsynced.add(name)
        self._shapes = None

    def position(self, name: str) -> Point:
        """Return the current position of the obstacle's centre."""
        pose, shift = self._obstacles[name].pose, self._shift.get(name, (0.0, 0.0))
        return pose.x + shift[0], pose.y + shift[1]

    def nearest(self, x: float, y: float, reach: float = math.inf) -> Nearest | None:
        """Return the surface nearest to a point, None if none is within `reach` m."""
        self._sync()
        hit = self._space.point_query_nearest((x, y), reach, EVERYTHING)
        if hit is None or hit.shape is None:
            return None
        return Nearest(hit.distance, self._names[hit.shape], (hit.point.x, hit.point.y))

    def within(self, x: float, y: float, reach: float) -> list[Nearest]:
        """Return the nearest surface of every obstacle less than `reach` m away, sorted by name."""
        self._sync()
        nearest: dict[str, Nearest] = {}
        for hit in self._space.point_query((x, y), reach, EVERYTHING):
            assert hit.shape is not None  # point_query returns hits only
            name = self._names[hit.shape]
            if name not in nearest or hit.distance < nearest[name].distance:
                nearest[name] = Nearest(hit.distance, name, (hit.point.x, hit.point.y))
        return [nearest[name] for name in sorted(nearest)]

    def cast(self, sensor: Pose, beams: Beams) -> Array:
        """Return the exact range along each beam; see `sim.lidar.cast`."""
        return cast(self.shapes(), sensor, beams)

    def shapes(self) -> Shapes:
        """Return the obstacles as arrays of primitives, at their current positions."""
        if self._outline is None:
            self._outline = Outline((o.pose, o.parts()) for o in self._obstacles.values())
            self._shapes = None
        if self._shapes is None:
            shift = None
            if self._shift:
                shift = np.array([complex(*self._shift.get(name, (0.0, 0.0))) for name in self._obstacles])
            self._shapes = self._outline.shapes(shift)
        return self._shapes

    def _sync(self) -> None:
        """Update the positions in pymunk of obstacles that have moved since the last query."""
        for name in sorted(self._unsynced):
            body = self._bodies[name]
            body.position = self.position(name)
            self._space.reindex_shapes_for_body(body)
        self._unsynced.clear()


def _pymunk_shape(body: pymunk.Body, part: Part) -> pymunk.Shape:
    match part:
        case SegmentPart():
            return pymunk.Segment(body, part.start, part.end, 0.0)
        case CirclePart():
            return pymunk.Circle(body, part.radius, part.center)
        case PolygonPart():
            return pymunk.Poly(body, list(part.corners))
