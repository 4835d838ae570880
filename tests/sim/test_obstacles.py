"""Obstacles: which ones are refused, and the convex parts of a polygon."""

import math
from collections.abc import Callable

import pytest

from sim import Box, Circle, Polygon, Wall
from sim.obstacles import PolygonPart
from sim.polygon import signed_area


@pytest.mark.parametrize(
    ("make", "needed"),
    [
        (lambda: Circle((0, 0), 0), "a radius above 0"),
        (lambda: Circle((0, math.nan), 1), "finite numbers"),
        (lambda: Box((0, 0), (1, -1)), "a size above 0"),
        (lambda: Wall((1, 1), (1, 1)), "two different ends"),
        (lambda: Polygon(((0, 0), (1, 1), (2, 2))), "three corners or more"),
    ],
)
def test_an_impossible_obstacle_is_refused_on_creation(make: Callable[[], object], needed: str) -> None:
    with pytest.raises(ValueError, match=needed):
        make()


def test_a_polygon_that_is_not_convex_is_filled_by_triangles() -> None:
    comb = Polygon(((0, 0), (5, 0), (5, 2), (4, 2), (4, 1), (3, 1), (3, 2), (2, 2), (2, 1), (1, 1), (1, 2), (0, 2)))
    parts = comb.parts()
    areas = [signed_area(p.corners) for p in parts if isinstance(p, PolygonPart)]
    assert len(areas) == len(parts) > 1
    assert min(areas) > 0
    assert sum(areas) == pytest.approx(signed_area(comb.points)) == 8
