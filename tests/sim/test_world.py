"""Worlds made in code: names and transformations."""

import math

import pytest

from sim import Box, Circle, Pose, World


def test_obstacles_without_a_name_are_given_one() -> None:
    world = World(obstacles=(Circle((0, 1), 0.1), Circle((0, 2), 0.1, name="circle 1"), Box((5, 5), (1, 1))))
    assert [o.name for o in world.obstacles] == ["circle 2", "circle 1", "box 1"]


def test_two_obstacles_with_the_same_name_are_refused() -> None:
    with pytest.raises(ValueError, match="named 'a'"):
        World(obstacles=(Circle((0, 1), 0.1, name="a"), Circle((0, 2), 0.1, name="a")))


def test_a_world_is_mirrored_rotated_and_shifted_in_this_order() -> None:
    world = World(obstacles=(Circle((1.0, 1.0), 0.1),), start=Pose(1.0, 1.0, 0.2), goals=(Pose(2.0, 0.0),))
    moved = world.transformed(mirror=True, rotate=math.pi / 2, shift=(10.0, 0.0), seed=9)
    # (1, 1) -> mirrored (1, -1) -> rotated (1, 1) -> shifted (11, 1)
    assert moved.obstacles[0].center == pytest.approx((11.0, 1.0))
    assert (moved.start.x, moved.start.y, moved.start.yaw) == pytest.approx((11.0, 1.0, math.pi / 2 - 0.2))
    assert (moved.goals[0].x, moved.goals[0].y) == pytest.approx((10.0, 2.0))
    assert moved.seed == 9
