"""The scenes for the benchmarks: a room of 20 x 20 m with seeded boxes and circles, and poses in it."""

from __future__ import annotations

import math

import numpy as np

from sim import Box, Circle, Obstacle, Pose, World, room
from sim.scene import Scene


def hall(count: int, seed: int = 7) -> World:
    """Return a room with `count` obstacles, half of them boxes, half circles; the robot starts in the free centre."""
    rng = np.random.default_rng(seed)
    obstacles: list[Obstacle] = list(room((-10.0, -10.0), (10.0, 10.0)))
    while len(obstacles) < count + 4:
        x, y = rng.uniform(-9.5, 9.5, 2).tolist()
        w, h = rng.uniform(0.2, 0.8, 2).tolist()
        if math.hypot(x, y) < 1.5:
            continue
        if len(obstacles) % 2:
            obstacles.append(Circle((x, y), w / 2))
        else:
            obstacles.append(Box((x, y), (w, h), float(rng.uniform(-3, 3))))
    return World(f"hall of {count}", tuple(obstacles))


def poses(world: World, count: int = 20, seed: int = 11) -> list[Pose]:
    """Return poses in the room with a clearance of 0.3 m."""
    rng = np.random.default_rng(seed)
    scene, found = Scene(world.obstacles), []
    while len(found) < count:
        x, y, yaw = [*rng.uniform(-9, 9, 2).tolist(), float(rng.uniform(-3, 3))]
        nearest = scene.nearest(x, y)
        if nearest is None or nearest.distance > 0.3:
            found.append(Pose(x, y, yaw))
    return found
