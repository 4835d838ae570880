"""Cast lidar rays at line segments, circles and convex polygons. Pure geometry: no noise, no ROS, no drawing.

Each primitive is tested only against the beams inside the arc of bearings that it covers, seen from the sensor. All
primitives are handled in one go with numpy, so a scan of 360 beams among 20 obstacles costs about 0.1 ms and is exact:
it equals pymunk's `segment_query_first` (see tests/sim/test_lidar.py).
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from sim.geometry import Pose
from sim.obstacles import CirclePart, Part, PolygonPart, SegmentPart

Array = NDArray[np.float64]

# A wall without thickness seen edge-on is invisible; "edge-on" is a sensor this near (m) to the wall's line.
EDGE_ON_M = 1e-12
# Arcs are widened by this part of a beam, so that no ray slips through the joint of two edges.
WIDER_BEAMS = 1e-9


@dataclass(frozen=True)
class Beams:
    """The beams of a lidar: the first one's angle and the step between them, in radians from the sensor's x axis."""

    count: int = 360
    angle_min: float = -math.pi
    increment: float = math.tau / 360
    range_max: float = 12.0

    @property
    def angles(self) -> Array:
        """The angle of each beam."""
        return self.angle_min + self.increment * np.arange(self.count, dtype=np.float64)

    @property
    def is_full_circle(self) -> bool:
        """Whether the beam after the last one is the first one."""
        return abs(self.count * self.increment - math.tau) < 1e-9


@dataclass(frozen=True)
class Shapes:
    """Primitives in arrays: walls without thickness, edges of convex polygons, circles.

    Attributes:
        points: shape (2, 2n + k): the starts of n segments, their ends, then k circle centres.
        lengths: of the n segments, m.
        thin: how many of the segments, at the front, are walls without thickness; the others are polygon edges.
        polygons: index of the first edge of each polygon, counted from `thin`.
        radii: of the k circles.
    """

    points: Array
    lengths: Array
    thin: int
    polygons: NDArray[np.intp]
    radii: Array

    @classmethod
    def of(cls, placed: Iterable[tuple[Pose, Iterable[Part]]]) -> Shapes:
        """Return the arrays for parts at poses."""
        return Outline(placed).shapes()


class Outline:
    """Parts at poses, sorted into arrays, with the owner of every point, so that owners can be moved."""

    def __init__(self, placed: Iterable[tuple[Pose, Iterable[Part]]]):
        thin: list[tuple[float, float, float, float, int]] = []
        edges: list[tuple[float, float, float, float, int]] = []
        circles: list[tuple[float, float, float, int]] = []
        starts: list[int] = []
        for owner, (pose, parts) in enumerate(placed):
            for part in parts:
                match part:
                    case SegmentPart():
                        thin.append((*pose.point_to_parent(part.start), *pose.point_to_parent(part.end), owner))
                    case PolygonPart():
                        starts.append(len(edges))
                        corners = [pose.point_to_parent(c) for c in part.corners]
                        ring = zip(corners, corners[1:] + corners[:1], strict=True)
                        edges.extend((*a, *b, owner) for a, b in ring)
                    case CirclePart():
                        circles.append((*pose.point_to_parent(part.center), part.radius, owner))
        segments = np.array(thin + edges, dtype=float).reshape(-1, 5)
        rounds = np.array(circles, dtype=float).reshape(-1, 4)
        self._points = np.vstack([segments[:, 0:2], segments[:, 2:4], rounds[:, 0:2]]).T.copy()
        self._owners = np.concatenate([segments[:, 4], segments[:, 4], rounds[:, 3]]).astype(np.intp)
        self._lengths = np.hypot(segments[:, 2] - segments[:, 0], segments[:, 3] - segments[:, 1])
        self._thin = len(thin)
        self._polygons = np.array(starts, dtype=np.intp)
        self._radii = rounds[:, 2].copy()

    def shapes(self, moved: Array | None = None) -> Shapes:
        """Return the arrays; `moved` has shape (2, owners) and shifts each owner's points, in metres."""
        points = self._points if moved is None else self._points + moved[:, self._owners]
        return Shapes(points, self._lengths, self._thin, self._polygons, self._radii)


@lru_cache(maxsize=32)
def _directions(beams: Beams) -> tuple[Array, Array]:
    """Return cos and sin of each beam's angle; twice round for a full circle, so that arcs may cross its seam."""
    angles = beams.angles
    cos, sin = np.cos(angles), np.sin(angles)
    return (np.concatenate([cos, cos]), np.concatenate([sin, sin])) if beams.is_full_circle else (cos, sin)


def cast(shapes: Shapes, sensor: Pose, beams: Beams) -> Array:
    """Return the range along each beam in metres, shape (beams.count,).

    `sensor` is in the frame of the shapes; beam angles run counter-clockwise from its x axis. A beam that meets nothing
    within `range_max` reads inf. If the sensor is inside a shape, or touches one, every beam reads 0.
    """
    n = shapes.lengths.size
    x, y = _in_sensor_frame(shapes.points, sensor)
    ax, ay, bx, by, cx, cy = x[:n], y[:n], x[n : 2 * n], y[n : 2 * n], x[2 * n :], y[2 * n :]

    area = (
        ax * by - ay * bx
    )  # twice the triangle sensor-a-b: distance of the line times length, below 0 = seen from outside
    edge_on = EDGE_ON_M * shapes.lengths
    power = cx * cx + cy * cy - shapes.radii * shapes.radii  # of the sensor with respect to each circle
    if _inside(shapes, area, edge_on, ax * bx + ay * by, power):
        return np.zeros(beams.count)

    seen = area < -edge_on
    thin = shapes.thin
    seen[:thin] |= area[:thin] > edge_on[:thin]
    ax, ay, bx, by, area = ax[seen], ay[seen], bx[seen], by[seen], area[seen]
    left = area > 0
    reach = np.arcsin(shapes.radii / np.sqrt(power + shapes.radii * shapes.radii))
    low = np.concatenate([np.arctan2(np.where(left, ay, by), np.where(left, ax, bx)), np.arctan2(cy, cx) - reach])
    span = np.concatenate([np.arctan2(np.abs(area), ax * bx + ay * by), 2 * reach])

    cos, sin = _directions(beams)
    owner, beam = _pairs(low, span, beams)
    dx, dy = cos[beam], sin[beam]
    # Work with 1 / range: linear in the direction for a line, and the nearest hit is the greatest.
    cut = int(np.searchsorted(owner, area.size))
    inverse = np.empty(owner.size)
    on_line, on_circle = owner[:cut], owner[cut:] - area.size
    inverse[:cut] = dx[:cut] * ((by - ay) / area)[on_line] - dy[:cut] * ((bx - ax) / area)[on_line]
    if on_circle.size:
        along = dx[cut:] * cx[on_circle] + dy[cut:] * cy[on_circle]
        c = power[on_circle]
        inverse[cut:] = (along + np.sqrt(np.maximum(along * along - c, 0.0))) / c

    nearest = np.zeros(cos.size)
    np.maximum.at(nearest, beam, inverse)
    if cos.size > beams.count:
        nearest = np.maximum(nearest[: beams.count], nearest[beams.count :])
    ranges = np.full(beams.count, np.inf)
    np.divide(1.0, nearest, out=ranges, where=nearest > 0)
    ranges[ranges > beams.range_max] = np.inf
    return ranges


def _in_sensor_frame(points: Array, sensor: Pose) -> tuple[Array, Array]:
    c, s = math.cos(sensor.yaw), math.sin(sensor.yaw)
    dx, dy = points[0] - sensor.x, points[1] - sensor.y
    return c * dx + s * dy, c * dy - s * dx


def _inside(shapes: Shapes, area: Array, edge_on: Array, dot: Array, power: Array) -> bool:
    """Tell whether the sensor is in or on a shape."""
    thin = shapes.thin
    if power.size and power.min() <= 0:
        return True
    if thin and ((np.abs(area[:thin]) <= edge_on[:thin]) & (dot[:thin] <= 0)).any():
        return True  # on the line of a wall, and between its ends
    # Outside of a convex polygon there is an edge whose outer side one sees.
    polygons = shapes.polygons
    return bool(polygons.size) and not bool(np.logical_or.reduceat(area[thin:] < 0, polygons).all())


def _pairs(low: Array, span: Array, beams: Beams) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return which primitive meets which beam: two arrays, sorted by primitive.

    For a full circle the beam index runs up to twice `beams.count`: take it modulo the count.
    """
    turn = math.tau / beams.increment
    begin = (low - beams.angle_min) / beams.increment
    begin -= turn * np.floor(begin / turn)
    end = begin + (span / beams.increment + WIDER_BEAMS)
    first = np.ceil(begin - WIDER_BEAMS).astype(np.intp)
    count = np.floor(end).astype(np.intp) - first + 1
    primitive = np.arange(low.size)
    if not beams.is_full_circle:
        # An arc may begin before the first beam's angle and come round to it: take it once more, a turn earlier.
        again = np.ceil(begin - turn - WIDER_BEAMS).astype(np.intp)
        last = np.concatenate([first + count - 1, np.floor(end - turn).astype(np.intp)])
        first = np.maximum(np.concatenate([first, again]), 0)
        count = np.maximum(np.minimum(last, beams.count - 1) - first + 1, 0)
        order = np.argsort(np.concatenate([primitive, primitive]), kind="stable")
        primitive = np.concatenate([primitive, primitive])[order]
        first, count = first[order], count[order]
    ends = np.cumsum(count)
    total = int(ends[-1]) if ends.size else 0
    beam = np.arange(total) + np.repeat(first - ends + count, count)
    return np.repeat(primitive, count), beam
