"""Cast lidar rays at line segments, circles and convex polygons. Pure geometry: no noise, no ROS, no drawing.

Each primitive is tested only against the beams inside the arc of bearings that it covers, seen from the sensor. Numpy
handles all primitives at once, so a scan of 360 beams among 20 obstacles takes about 0.1 ms. The result is exact: it
equals pymunk's `segment_query_first` (see tests/sim/test_lidar.py). Points are complex numbers, x + iy, which halves
the number of numpy calls: the real part of `conj(a) * b` is the dot product of a and b, the imaginary part the cross
product.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from sim.geometry import Point, Pose
from sim.obstacles import CirclePart, Part, PolygonPart, SegmentPart

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Indexes = NDArray[np.intp]

# A wall without thickness is invisible edge-on, that is, for a sensor this near (m) to the wall's line.
EDGE_ON_M = 1e-12
# Arcs are widened by this fraction of a beam, so that no ray slips between two adjoining edges.
WIDER_BEAMS = 1e-9


@dataclass(frozen=True)
class Beams:
    """The beams of a lidar: number, angle of the first and step (rad, from the sensor's x axis), range (m)."""

    count: int = 360
    angle_min: float = -math.pi
    increment: float = math.tau / 360
    range_max: float = 12.0

    @property
    def angles(self) -> Array:
        """The angle of each beam in rad, shape (count,)."""
        return self.angle_min + self.increment * np.arange(self.count, dtype=np.float64)

    @property
    def is_full_circle(self) -> bool:
        """Whether the beam after the last is the first again."""
        return abs(self.count * self.increment - math.tau) < 1e-9


@dataclass(frozen=True)
class Shapes:
    """Primitives as arrays: walls without thickness, edges of convex polygons, circles.

    Attributes:
        points: x + iy in m: the starts of n segments, their ends, then k circle centres.
        edge_on: for each of the n segments, m²: it is seen edge-on if the cross product of the vectors from the sensor
            to its start and end is smaller than this.
        thin: how many segments, at the front, are walls without thickness; the others are polygon edges.
        polygons: index of each polygon's first edge, counted from `thin`.
        radii: of the k circles, m.
    """

    points: Complex
    edge_on: Array
    thin: int
    polygons: Indexes
    radii: Array


class Outline:
    """Parts with poses, sorted into arrays, with the owner of every point, so that owners can be moved."""

    def __init__(self, placed: Iterable[tuple[Pose, Iterable[Part]]]):
        walls: list[tuple[complex, complex, int]] = []
        edges: list[tuple[complex, complex, int]] = []
        circles: list[tuple[complex, float, int]] = []
        polygons: list[int] = []
        for owner, (pose, parts) in enumerate(placed):
            for part in parts:
                match part:
                    case SegmentPart():
                        walls.append((_place(pose, part.start), _place(pose, part.end), owner))
                    case PolygonPart():
                        polygons.append(len(edges))
                        corners = [_place(pose, c) for c in part.corners]
                        ring = zip(corners, corners[1:] + corners[:1], strict=True)
                        edges.extend((a, b, owner) for a, b in ring)
                    case CirclePart():
                        circles.append((_place(pose, part.center), part.radius, owner))
        segments = walls + edges
        starts, ends = [a for a, _, _ in segments], [b for _, b, _ in segments]
        owners = [owner for _, _, owner in segments]
        self._points = np.array(starts + ends + [c for c, _, _ in circles], dtype=np.complex128)
        self._owners = np.array(owners + owners + [owner for _, _, owner in circles], dtype=np.intp)
        self._edge_on = EDGE_ON_M * np.array([abs(b - a) for a, b, _ in segments], dtype=np.float64)
        self._thin = len(walls)
        self._polygons = np.array(polygons, dtype=np.intp)
        self._radii = np.array([r for _, r, _ in circles], dtype=np.float64)

    def shapes(self, shift: Complex | None = None) -> Shapes:
        """Return the arrays; `shift` moves the points of each owner, x + iy in m."""
        points = self._points if shift is None else self._points + shift[self._owners]
        return Shapes(points, self._edge_on, self._thin, self._polygons, self._radii)


def cast(shapes: Shapes, sensor: Pose, beams: Beams) -> Array:
    """Return the range along each beam in metres, shape (beams.count,).

    `sensor` is in the frame of the shapes; beam angles run counter-clockwise from its x axis. A beam that hits nothing
    within `range_max` reads inf. If the sensor is inside a shape or touches one, every beam reads 0.
    """
    # Transform everything into a frame at the sensor whose x axis is the first beam.
    turn = sensor.yaw + beams.angle_min
    points = (shapes.points - complex(sensor.x, sensor.y)) * complex(math.cos(turn), -math.sin(turn))
    n = shapes.edge_on.size
    a, b, center = points[:n], points[n : 2 * n], points[2 * n :]

    product = a.conj() * b  # dot and cross product; a negative cross product is a polygon's edge seen from outside
    power = center.real**2 + center.imag**2 - shapes.radii**2  # of the sensor with respect to each circle
    seen = product.imag < -shapes.edge_on
    if _hides_sensor(shapes, seen, product, power):
        return np.zeros(beams.count)

    a, b, product = a[seen], b[seen], product[seen]
    cross = product.imag
    low_end = np.where(cross > 0, a, b)
    # The arc of bearings that each primitive covers, and a key that yields the range along a beam's direction.
    arcs = [np.arctan2(low_end.imag, low_end.real), np.arctan2(np.abs(cross), product.real)]
    keys = (b - a) * -1j / cross
    if power.size:
        half = np.arctan2(shapes.radii, np.sqrt(power))
        bearing = np.arctan2(center.imag, center.real) - half
        arcs = [np.concatenate([arcs[0], bearing]), np.concatenate([arcs[1], 2 * half])]
        keys = np.concatenate([keys, center])
    nearest = _nearest_inverse(arcs[0], arcs[1], keys, power, beams)
    ranges: Array = 1.0 / nearest
    ranges[ranges > beams.range_max] = np.inf
    return ranges


def _place(pose: Pose, point: Point) -> complex:
    return complex(*pose.point_to_parent(point))


def _hides_sensor(shapes: Shapes, seen: NDArray[np.bool_], product: Complex, power: Array) -> bool:
    """Return whether the sensor is in or on a shape. Also completes `seen`: thin walls are visible from both sides."""
    if power.size and power.min() <= 0:
        return True
    thin = shapes.thin
    if thin:
        seen[:thin] |= product.imag[:thin] > shapes.edge_on[:thin]
        if not seen[:thin].all() and (product.real[:thin][~seen[:thin]] <= 0).any():
            return True  # on the line of a wall, and between its ends
    # From outside a convex polygon, the outer side of at least one edge is visible.
    polygons = shapes.polygons
    return bool(polygons.size) and not bool(np.logical_or.reduceat(seen[thin:], polygons).all())


def _nearest_inverse(low: Array, span: Array, keys: Complex, power: Array, beams: Beams) -> Array:
    """Return 1 / range along each beam; where nothing is hit, a value below 1 / range_max."""
    # Arcs start after -3/4 of a turn and end before a full turn, so a table of two turns holds them.
    n = beams.count
    if not beams.is_full_circle:
        turn = math.ceil(math.tau / beams.increment)
        seen_at_once = _sweep(low, span, keys, power, beams, turn, 2 * turn + 1)[turn : turn + n]
        a_turn_later = _sweep(low + math.tau, span, keys, power, beams, turn, 3 * turn + 1)[turn : turn + n]
        return np.maximum(seen_at_once, a_turn_later)
    table = _sweep(low, span, keys, power, beams, n, 2 * n + 1)
    nearest = np.maximum(table[:n], table[n : 2 * n])
    nearest[0] = max(nearest[0], table[2 * n])
    return nearest


def _sweep(low: Array, span: Array, keys: Complex, power: Array, beams: Beams, shift: int, size: int) -> Array:
    """Return 1 / range for a table of `size` beams, in which index `shift` is the first beam.

    The arcs, in rad from the first beam, are those of the lines, then those of the circles. A line's key is its normal
    divided by its distance, a circle's its centre, with the sensor's power. For a line 1 / range is linear in the
    beam's direction; the largest 1 / range is the nearest hit.
    """
    begin = low / beams.increment + (shift + 1)  # above 0, so that truncating rounds down
    first = (begin - WIDER_BEAMS).astype(np.intp)
    stop = (begin + (span / beams.increment + WIDER_BEAMS)).astype(np.intp)
    count = stop - first
    ends = count.cumsum()
    primitive = np.arange(low.size).repeat(count)
    beam = np.arange(primitive.size) + (stop - ends)[primitive]
    inverse = (_directions(beams, shift, size)[beam] * keys[primitive]).real
    lines = low.size - power.size
    if power.size:
        cut = int(ends[lines - 1]) if lines else 0
        along, c = inverse[cut:], power[primitive[cut:] - lines]
        inverse[cut:] = (along + np.sqrt(np.maximum(along * along - c, 0.0))) / c
    table = np.empty(size)
    table.fill(0.5 / beams.range_max)
    np.maximum.at(table, beam, inverse)
    return table


@lru_cache(maxsize=32)
def _directions(beams: Beams, shift: int, size: int) -> Complex:
    """Return the conjugate direction of each beam in a table, relative to the first beam."""
    directions: Complex = np.exp(-1j * beams.increment * (np.arange(size) - shift))
    return directions
