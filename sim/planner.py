"""Find a way through a world for the demonstration: shortest path on a grid, straightened. Standing obstacles only."""

from __future__ import annotations

import heapq
import math

from sim.geometry import Point
from sim.scene import Scene
from sim.world import World

CELL = 0.1  # m
FAR = 15.0  # m from the start: the search goes no further

Cell = tuple[int, int]


def plan(world: World, start: Point, goal: Point, room: float) -> list[Point]:
    """Return the corners of a way from start to goal that keeps `room` m from what stands; the goal is the last.

    If there is no such way, the goal alone.
    """
    standing = [o for o in world.obstacles if o.motion is None and o.appears is None and o.vanishes is None]
    scene = Scene(standing)
    cells = _search(scene, start, goal, room)
    return _straightened(scene, [start, *cells, goal], room)[1:] if cells is not None else [goal]


def _search(scene: Scene, start: Point, goal: Point, room: float) -> list[Point] | None:
    """Return the centres of the cells of the shortest way (A*), None if there is no way."""
    begin, end = _cell(start), _cell(goal)
    free: dict[Cell, bool] = {begin: True, end: True}
    cost: dict[Cell, float] = {begin: 0.0}
    came: dict[Cell, Cell] = {}
    queue = [(0.0, begin)]
    while queue:
        _, cell = heapq.heappop(queue)
        if cell == end:
            way = [cell]
            while way[-1] in came:
                way.append(came[way[-1]])
            return [(i * CELL, j * CELL) for i, j in reversed(way[1:-1])]
        for di, dj in ((1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (1, -1), (-1, 1), (-1, -1)):
            near = (cell[0] + di, cell[1] + dj)
            if near not in free:
                free[near] = _is_free(scene, (near[0] * CELL, near[1] * CELL), room)
            new = cost[cell] + math.hypot(di, dj)
            if free[near] and new < cost.get(near, math.inf) and math.dist(near, begin) * CELL < FAR:
                cost[near], came[near] = new, cell
                heapq.heappush(queue, (new + math.dist(near, end), near))
    return None


def _straightened(scene: Scene, way: list[Point], room: float) -> list[Point]:
    """Leave out every corner that can be cut while keeping the room."""
    result, here = [way[0]], 0
    while here < len(way) - 1:
        reach = here + 1
        for there in range(len(way) - 1, here, -1):
            if _is_line_free(scene, way[here], way[there], room):
                reach = there
                break
        result.append(way[reach])
        here = reach
    return result


def _is_line_free(scene: Scene, a: Point, b: Point, room: float) -> bool:
    steps = max(1, math.ceil(math.dist(a, b) / (CELL / 2)))
    between = [(a[0] + (b[0] - a[0]) * i / steps, a[1] + (b[1] - a[1]) * i / steps) for i in range(1, steps)]
    return all(_is_free(scene, p, room) for p in between)


def _is_free(scene: Scene, p: Point, room: float) -> bool:
    nearest = scene.nearest(p[0], p[1], room)
    return nearest is None or nearest.distance >= room


def _cell(p: Point) -> Cell:
    return round(p[0] / CELL), round(p[1] / CELL)
