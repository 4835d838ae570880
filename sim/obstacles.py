"""Obstacles: walls, boxes, circles and polygons, and how they move.

Values only. An obstacle gives its shape as convex parts in its own frame, for ray casting and contact detection.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from sim.geometry import Point, Pose
from sim.polygon import is_convex, signed_area, triangulate

When = float | str
"""A moment: simulated time in s, or the name of an event passed to `Simulator.trigger`."""


@dataclass(frozen=True)
class SegmentPart:
    """A line without thickness, visible from both sides."""

    start: Point
    end: Point


@dataclass(frozen=True)
class CirclePart:
    """A filled circle."""

    center: Point
    radius: float


@dataclass(frozen=True)
class PolygonPart:
    """A filled convex polygon; corners counter-clockwise."""

    corners: tuple[Point, ...]


Part = SegmentPart | CirclePart | PolygonPart


@dataclass(frozen=True)
class Path:
    """Scripted motion of an obstacle's centre along waypoints, starting at the obstacle's position.

    Attributes:
        waypoints: positions of the centre, map frame, metres.
        speed: m/s.
        repeat: stop at the end (`once`), return to the start and go on (`loop`), or go back and forth.
        starts: simulated time in s, or an event's name.
        wakes_within: if given, start only when the robot is this near (m, centre to centre).
        yields_within: if given, stand still while the robot is this near (m, centre to centre).
    """

    waypoints: tuple[Point, ...]
    speed: float
    repeat: Literal["once", "loop", "back_and_forth"] = "once"
    starts: When = 0.0
    wakes_within: float | None = None
    yields_within: float | None = None


@dataclass(frozen=True, kw_only=True)
class _Common:
    """The attributes of every obstacle: a name, when it appears and vanishes, its motion."""

    name: str = ""
    appears: When | None = None
    vanishes: When | None = None
    motion: Path | None = None


@dataclass(frozen=True)
class Wall(_Common):
    """A straight wall from `start` to `end`; one with a thickness has round ends."""

    start: Point
    end: Point
    thickness: float = 0.0

    def __post_init__(self) -> None:
        _demand(self.start != self.end and self.thickness >= 0, self, "two different ends and a thickness of 0 or more")
        _demand_finite(self, *self.start, *self.end, self.thickness)

    @property
    def pose(self) -> Pose:
        """The middle of the wall, with axes parallel to the map's."""
        return Pose((self.start[0] + self.end[0]) / 2, (self.start[1] + self.end[1]) / 2)

    def parts(self) -> tuple[Part, ...]:
        """Return a line, or a rectangle with a circle at each end, the shape of a pymunk segment with a radius."""
        middle = self.pose
        a, b = middle.point_from_parent(self.start), middle.point_from_parent(self.end)
        r = self.thickness / 2
        if r == 0:
            return (SegmentPart(a, b),)
        length = math.dist(a, b)
        nx, ny = -(b[1] - a[1]) / length * r, (b[0] - a[0]) / length * r
        rectangle = ((a[0] - nx, a[1] - ny), (b[0] - nx, b[1] - ny), (b[0] + nx, b[1] + ny), (a[0] + nx, a[1] + ny))
        return (PolygonPart(rectangle), CirclePart(a, r), CirclePart(b, r))


@dataclass(frozen=True)
class Box(_Common):
    """A filled rectangle: centre and size along its own x and y axes (m), yaw (rad)."""

    center: Point
    size: tuple[float, float]
    yaw: float = 0.0

    def __post_init__(self) -> None:
        _demand(min(self.size) > 0, self, "a size above 0 in both directions")
        _demand_finite(self, *self.center, *self.size, self.yaw)

    @property
    def pose(self) -> Pose:
        """The centre, rotated by yaw."""
        return Pose(*self.center, self.yaw)

    def parts(self) -> tuple[Part, ...]:
        """Return one rectangle."""
        return (PolygonPart(_rectangle(-self.size[0] / 2, -self.size[1] / 2, self.size[0] / 2, self.size[1] / 2)),)


@dataclass(frozen=True)
class Circle(_Common):
    """A filled circle."""

    center: Point
    radius: float

    def __post_init__(self) -> None:
        _demand(self.radius > 0, self, "a radius above 0")
        _demand_finite(self, *self.center, self.radius)

    @property
    def pose(self) -> Pose:
        """The centre."""
        return Pose(*self.center)

    def parts(self) -> tuple[Part, ...]:
        """Return the circle itself."""
        return (CirclePart((0.0, 0.0), self.radius),)


@dataclass(frozen=True)
class Polygon(_Common):
    """A filled polygon that does not cross itself, convex or not; corners clockwise or counter-clockwise."""

    points: tuple[Point, ...]

    def __post_init__(self) -> None:
        _demand(
            len(self.points) >= 3 and signed_area(self.points) != 0, self, "three corners or more that enclose an area"
        )
        _demand_finite(self, *(v for p in self.points for v in p))

    @property
    def pose(self) -> Pose:
        """The mean of the corners, with axes parallel to the map's."""
        n = len(self.points)
        return Pose(sum(p[0] for p in self.points) / n, sum(p[1] for p in self.points) / n)

    def parts(self) -> tuple[Part, ...]:
        """Return the polygon if it is convex, else the triangles that fill it."""
        middle = self.pose
        corners = [middle.point_from_parent(p) for p in self.points]
        if signed_area(corners) < 0:
            corners.reverse()
        if is_convex(corners):
            return (PolygonPart(tuple(corners)),)
        return tuple(PolygonPart(t) for t in triangulate(corners))


Obstacle = Wall | Box | Circle | Polygon


def _demand(holds: bool, obstacle: object, needed: str) -> None:
    if not holds:
        raise ValueError(f"{obstacle} needs {needed}")


def _demand_finite(obstacle: object, *values: float) -> None:
    _demand(all(math.isfinite(v) for v in values), obstacle, "finite numbers")


def room(low: Point, high: Point, prefix: str = "") -> tuple[Wall, Wall, Wall, Wall]:
    """Return the four walls of a rectangular room, named by compass direction; north is along the y axis."""
    (x0, y0), (x1, y1) = low, high
    label = f"{prefix} " if prefix else ""
    return (
        Wall((x0, y0), (x1, y0), name=f"{label}south wall"),
        Wall((x1, y0), (x1, y1), name=f"{label}east wall"),
        Wall((x1, y1), (x0, y1), name=f"{label}north wall"),
        Wall((x0, y1), (x0, y0), name=f"{label}west wall"),
    )


def extreme_points(obstacle: Obstacle) -> list[Point]:
    """Return points in the map frame that span the obstacle's bounding box."""
    points: list[Point] = []
    for part in obstacle.parts():
        match part:
            case SegmentPart():
                points += [part.start, part.end]
            case CirclePart():
                (x, y), r = part.center, part.radius
                points += [(x - r, y - r), (x + r, y + r)]  # enough, because parts with circles are not rotated
            case PolygonPart():
                points += part.corners
    return [obstacle.pose.point_to_parent(point) for point in points]


def _rectangle(x0: float, y0: float, x1: float, y1: float) -> tuple[Point, Point, Point, Point]:
    return ((x0, y0), (x1, y0), (x1, y1), (x0, y1))
