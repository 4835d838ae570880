"""Polygons in the plane, as lists of corners: area, convexity, triangulation, self-intersection."""

from __future__ import annotations

import math
from collections.abc import Iterable

from sim.geometry import Point, normalize_angle


def signed_area(points: Iterable[Point]) -> float:
    """Return the polygon's area in m², positive when its corners run counter-clockwise."""
    corners = list(points)
    ring = zip(corners, corners[1:] + corners[:1], strict=True)
    return 0.5 * math.fsum(a[0] * b[1] - b[0] * a[1] for a, b in ring)


def triangulate(corners: list[Point]) -> list[tuple[Point, Point, Point]]:
    """Return triangles that fill a simple counter-clockwise polygon (ear clipping).

    Raises:
        ValueError: the outline crosses itself.
    """
    ring = list(corners)
    triangles: list[tuple[Point, Point, Point]] = []
    while len(ring) > 3:
        for i in range(len(ring)):
            a, b, c = ring[i - 1], ring[i], ring[(i + 1) % len(ring)]
            if _turn(a, b, c) > 0 and not any(_in_triangle(p, a, b, c) for p in ring if p not in (a, b, c)):
                triangles.append((a, b, c))
                del ring[i]
                break
        else:
            flat = [i for i in range(len(ring)) if _turn(ring[i - 1], ring[i], ring[(i + 1) % len(ring)]) == 0]
            if not flat:
                raise ValueError("the outline crosses itself")
            del ring[flat[0]]  # a corner on a straight line adds nothing
    if _turn(*ring) > 0:
        triangles.append((ring[0], ring[1], ring[2]))
    return triangles


def _turn(a: Point, b: Point, c: Point) -> float:
    """Return a number above 0 if the way a, b, c turns left, below 0 if it turns right, 0 if it is straight."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def _in_triangle(p: Point, a: Point, b: Point, c: Point) -> bool:
    return _turn(a, b, p) >= 0 and _turn(b, c, p) >= 0 and _turn(c, a, p) >= 0


def is_convex(corners: list[Point]) -> bool:
    """Return whether a counter-clockwise outline turns left at every corner and goes round once."""
    n = len(corners)
    if any(_turn(corners[i - 1], corners[i], corners[(i + 1) % n]) <= 0 for i in range(n)):
        return False
    heading = [
        math.atan2(corners[(i + 1) % n][1] - c[1], corners[(i + 1) % n][0] - c[0]) for i, c in enumerate(corners)
    ]
    turned = math.fsum(normalize_angle(heading[i] - heading[i - 1]) for i in range(n))
    return abs(turned - math.tau) < 1e-6


def crosses_itself(points: tuple[Point, ...]) -> bool:
    """Return whether two edges of the outline that are not neighbours meet."""
    n = len(points)
    edges = [(points[i], points[(i + 1) % n]) for i in range(n)]
    return (
        any(_meet(*edges[i], *edges[j]) for i in range(n) for j in range(i + 2, n) if not (i == 0 and j == n - 1))
        or len(set(points)) < n
    )


def _meet(a: Point, b: Point, c: Point, d: Point) -> bool:
    if max(a[0], b[0]) < min(c[0], d[0]) or max(c[0], d[0]) < min(a[0], b[0]):
        return False
    if max(a[1], b[1]) < min(c[1], d[1]) or max(c[1], d[1]) < min(a[1], b[1]):
        return False
    return _turn(a, b, c) * _turn(a, b, d) <= 0 and _turn(c, d, a) * _turn(c, d, b) <= 0
