"""The lidar is exact: it equals pymunk's own ray casting, and is right where pymunk is not."""

import math

import numpy as np
import pymunk
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sim import Box, Circle, Obstacle, Polygon, Pose, Wall
from sim.lidar import Beams, Outline, cast
from sim.polygon import signed_area

RANGE = 12.0
TOLERANCE = 1e-9
SIDE = 1e-9  # rad
GRAZING = 1e-6  # for a beam that hits a corner: pymunk itself misses some exact corners


# --------------------------------------------------------------------------- the oracle: pymunk, asked beam by beam


def space_with(obstacles: list[Obstacle]) -> pymunk.Space:
    """Build the same scene from pymunk's own shapes, using the obstacles' attributes and not our parts."""
    space = pymunk.Space()
    for o in obstacles:
        body = space.static_body
        match o:
            case Wall(thickness=0.0):
                space.add(pymunk.Segment(body, o.start, o.end, 0.0))
            case Wall():
                # Not a Segment with a radius: Chipmunk misses its round end when the ray also hits the flat side
                # (see test_the_round_end_of_a_thick_wall_is_hit_from_its_axis).
                r, length = o.thickness / 2, math.dist(o.start, o.end)
                nx, ny = (o.start[1] - o.end[1]) * r / length, (o.end[0] - o.start[0]) * r / length
                corners = [(x + k * nx, y + k * ny) for x, y in (o.start, o.end) for k in (1, -1)]
                space.add(pymunk.Poly(body, corners), pymunk.Circle(body, r, o.start), pymunk.Circle(body, r, o.end))
            case Circle():
                space.add(pymunk.Circle(body, o.radius, o.center))
            case Box():
                turned = pymunk.Transform(
                    math.cos(o.yaw), math.sin(o.yaw), -math.sin(o.yaw), math.cos(o.yaw), *o.center
                )
                w, h = o.size[0] / 2, o.size[1] / 2
                space.add(pymunk.Poly(body, [(-w, -h), (w, -h), (w, h), (-w, h)], turned))
            case Polygon():
                space.add(pymunk.Poly(body, list(o.points)))
    return space


def oracle(space: pymunk.Space, sensor: Pose, angle: float) -> float:
    bearing = sensor.yaw + angle
    end = (sensor.x + RANGE * math.cos(bearing), sensor.y + RANGE * math.sin(bearing))
    hit = space.segment_query_first((sensor.x, sensor.y), end, 0.0, pymunk.ShapeFilter())
    return math.inf if hit is None else hit.alpha * RANGE


def assert_same(obstacles: list[Obstacle], sensor: Pose, beams: Beams) -> None:
    """Every beam equals pymunk's; one that grazes a corner lies between pymunk's answers just beside it."""
    space = space_with(obstacles)
    surface = space.point_query_nearest((sensor.x, sensor.y), 1e-6, pymunk.ShapeFilter())
    if surface is not None and abs(surface.distance) < 1e-9:
        return  # on a surface: rounding decides whether this is inside
    ours = cast(Outline((o.pose, o.parts()) for o in obstacles).shapes(), sensor, beams)
    for angle, mine in zip(beams.angles.tolist(), ours.tolist(), strict=True):
        theirs = oracle(space, sensor, angle)
        if mine == theirs or abs(mine - theirs) <= TOLERANCE:
            continue
        beside = [theirs, oracle(space, sensor, angle - SIDE), oracle(space, sensor, angle + SIDE)]
        grazes = max(beside) - min(beside) > 1e-6
        assert grazes, (obstacles, sensor, angle, mine, beside)
        assert min(beside) - GRAZING <= mine <= max(beside) + GRAZING, (obstacles, sensor, angle, mine, beside)


# ---------------------------------------------------------------------------------------------------- random scenes

coordinate = st.floats(-6, 6, allow_subnormal=False).map(lambda v: round(v, 6))
point = st.tuples(coordinate, coordinate)
length = st.floats(0.01, 3).map(lambda v: round(v, 6))
angle = st.floats(-math.pi, math.pi).map(lambda v: round(v, 6))


@st.composite
def walls(draw: st.DrawFn) -> Wall:
    a, b = draw(point), draw(point)
    if math.dist(a, b) < 0.01:
        b = (a[0] + 1.0, a[1])
    return Wall(a, b, draw(st.sampled_from([0.0, 0.0, 0.05, 0.3])))


@st.composite
def convex_polygons(draw: st.DrawFn) -> Polygon:
    center, count = draw(point), draw(st.integers(3, 7))
    radius, turn = draw(st.floats(0.1, 2)), draw(angle)
    clockwise = draw(st.booleans())
    ring = [turn + i * math.tau / count for i in range(count)]
    corners = [(center[0] + radius * math.cos(a), center[1] + radius * math.sin(a)) for a in ring]
    return Polygon(tuple(corners[::-1] if clockwise else corners))


boxes = st.builds(Box, point, st.tuples(length, length), angle)
circles = st.builds(Circle, point, length)
scenes = st.lists(st.one_of(walls(), boxes, circles, convex_polygons()), min_size=0, max_size=12)
sensors = st.builds(Pose, coordinate, coordinate, angle)
BEAMS = Beams(count=45, increment=math.tau / 45)


@settings(max_examples=250, derandomize=True, database=None)
@given(scenes, sensors)
def test_every_beam_equals_pymunks_segment_query_first(obstacles: list[Obstacle], sensor: Pose) -> None:
    assert_same(obstacles, sensor, BEAMS)


@settings(max_examples=60, derandomize=True, database=None)
@given(scenes, sensors, angle, st.floats(0.1, 6.0))
def test_a_lidar_with_a_partial_field_of_view_equals_pymunk_too(
    obstacles: list[Obstacle], sensor: Pose, first: float, width: float
) -> None:
    assert_same(obstacles, sensor, Beams(count=40, angle_min=first, increment=width / 39))


@pytest.mark.parametrize("seed", range(3))
def test_a_crowded_hall_equals_pymunk(seed: int) -> None:
    """200 obstacles at uniformly random positions, 360 beams."""
    rng = np.random.default_rng(seed)
    obstacles: list[Obstacle] = []
    for _ in range(100):
        x, y, w, h, yaw = rng.uniform(-10, 10, 2).tolist() + rng.uniform(0.1, 0.8, 2).tolist() + [rng.uniform(-3, 3)]
        obstacles += [Box((x, y), (w, h), yaw), Circle((y, -x), w / 2)]
    x, y = rng.uniform(-10, 10, 2).tolist()
    assert_same(obstacles, Pose(x, y, rng.uniform(-3, 3)), Beams())


# ------------------------------------------------------------------------------------- cases with a known answer


def ranges(obstacles: list[Obstacle], sensor: Pose = Pose(), beams: Beams = Beams()) -> np.ndarray:  # noqa: B008 - frozen
    return cast(Outline((o.pose, o.parts()) for o in obstacles).shapes(), sensor, beams)


def test_the_middle_beam_measures_the_distance_of_a_wall_ahead() -> None:
    seen = ranges([Wall((2.0, -1.0), (2.0, 1.0))])
    assert seen[180] == pytest.approx(2.0, abs=1e-12)
    assert seen[180 + 20] == pytest.approx(2.0 / math.cos(math.radians(20)), abs=1e-12)
    assert np.isinf(seen[0])


@pytest.mark.parametrize(
    "obstacle",
    [
        Circle((0.1, 0.0), 0.3),
        Box((0.0, 0.1), (1.0, 1.0), 0.3),
        Polygon(((-1, -1), (1, -1), (0, 2))),
        Wall((-1, 0.01), (1, 0.01), 0.1),
    ],
    ids=["circle", "box", "polygon", "thick wall"],
)
def test_inside_an_obstacle_every_beam_reads_zero(obstacle: Obstacle) -> None:
    assert (ranges([obstacle, Circle((3.0, 0.0), 1.0)]) == 0.0).all()


def test_on_a_wall_every_beam_reads_zero() -> None:
    assert (ranges([Wall((-1.0, 0.0), (1.0, 0.0))]) == 0.0).all()


def test_a_thin_wall_seen_edge_on_is_invisible() -> None:
    assert np.isinf(ranges([Wall((1.0, 0.0), (2.0, 0.0))])).all()


def test_the_round_end_of_a_thick_wall_is_hit_from_its_axis() -> None:
    """Chipmunk's segment with a radius reads 1.106 m here, the flat side behind the round end that is hit first."""
    beams = Beams(count=1, angle_min=math.pi + 0.0226, increment=1.0)
    seen = ranges([Wall((-2.0, 0.0), (-1.0, 0.0), 0.05)], beams=beams)[0]
    assert math.hypot(seen * math.cos(0.0226) - 1.0, seen * math.sin(0.0226)) == pytest.approx(0.025, abs=1e-12)
    assert seen == pytest.approx(0.989, abs=1e-3)


def test_an_l_shaped_polygon_is_measured_as_an_l() -> None:
    """Not as its convex hull: the beam reaches into the notch."""
    ell = Polygon(((1, -1), (3, -1), (3, 1), (2, 1), (2, 0), (1, 0)))
    seen = ranges([ell], Pose(0.0, 0.5, 0.0))
    assert signed_area(ell.points) == 3
    assert seen[180] == pytest.approx(2.0)
    assert seen[180 - 45] == pytest.approx(math.sqrt(2))


def test_no_beam_slips_between_two_adjoining_walls() -> None:
    corner: list[Obstacle] = [Wall((1.0, 0.0), (0.0, 1.0)), Wall((1.0, 0.0), (0.0, -1.0))]
    for yaw in np.linspace(-0.5, 0.5, 101):
        assert ranges(corner, Pose(0.0, 0.0, float(yaw)))[180] <= 1.0 + 1e-9
