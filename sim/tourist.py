"""The built-in driver: it plans a way to each goal on the map and follows it."""

from __future__ import annotations

import heapq
import math

import numpy as np

from sim.drive import Seen
from sim.geometry import Point, Pose, Twist
from sim.scene import Scene
from sim.sensors import ScanReading
from sim.simulator import Simulator
from sim.world import World

CELL = 0.1  # m, of the planner's grid
FAR = 15.0  # m from the start: the planner searches no further

Cell = tuple[int, int]


class Tourist:
    """Visits a world's goals in order, along a way planned on the map, and waits while the way is blocked.

    In a world without goals it drives straight ahead and turns away from anything near. It exists to be watched and is
    not a model solution: it knows the map.
    """

    CRUISE = 0.4  # m/s
    ARRIVED = 0.06  # m
    LANE = 0.19  # m to each side: the hull and 2 cm
    STOP = 0.45  # m ahead, from the robot's centre

    def __init__(self, simulator: Simulator) -> None:
        self._simulator = simulator
        self._to_odom = simulator.odom_origin.inverse()
        self._lidar = simulator.profile.lidar.pose
        self._goals = [(goal.x, goal.y) for goal in simulator.world.goals]
        self._endless = not self._goals
        self._way: list[Point] = []
        self.is_blocked = False
        """Whether it waits because something is in its way."""

    def __call__(self, seen: Seen) -> Twist:
        """Return the command for the current readings."""
        ahead = self._free_ahead(seen.scan)
        if self._endless:
            return Twist(0.0, 0.8) if ahead < 0.7 else Twist(self.CRUISE, 0.0)
        target = self._next_target(seen.odometry.pose)
        if target is None:
            return Twist()
        pose = seen.odometry.pose
        x, y = pose.point_from_parent(target)
        bearing, distance = math.atan2(y, x), math.hypot(x, y)
        slow = 0.05 + distance if len(self._way) == 1 else self.CRUISE
        v = min(self.CRUISE, slow) * max(0.0, 1.0 - abs(bearing) / 0.8)
        self.is_blocked = v > 0.0 and ahead < min(self.STOP, distance + self.LANE)
        return Twist(0.0 if self.is_blocked else v, max(-1.5, min(1.5, 2.5 * bearing)))

    def go_to(self, x: float, y: float) -> None:
        """Drop all plans and go to a place (m, map frame)."""
        self._goals, self._way, self._endless, self.is_blocked = [(x, y)], [], False, False

    def has_arrived(self) -> bool:
        """Return whether all goals have been reached and the robot stands still."""
        return not (self._endless or self._goals or self._way) and self._simulator.twist == Twist()

    def _next_target(self, pose: Pose) -> Point | None:
        """Return the next point of the way in the odometry frame; plan a new way after reaching a goal."""
        while True:
            while self._way:
                target = self._to_odom.point_to_parent(self._way[0])
                if math.hypot(target[0] - pose.x, target[1] - pose.y) > self.ARRIVED:
                    return target
                self._way.pop(0)
            if not self._goals:
                return None
            here = self._simulator.odom_origin.point_to_parent((pose.x, pose.y))
            self._way = plan(self._simulator.world, here, self._goals.pop(0), self.LANE + 0.08)

    def _free_ahead(self, scan: ScanReading) -> float:
        """Return the distance to the first obstacle in the lane ahead, in m from the robot's centre."""
        valid = np.isfinite(scan.ranges)
        angles = scan.angles[valid] + self._lidar.yaw
        x = scan.ranges[valid] * np.cos(angles) + self._lidar.x
        y = scan.ranges[valid] * np.sin(angles) + self._lidar.y
        return float(x[(x > 0) & (np.abs(y) < self.LANE)].min(initial=math.inf))


def plan(world: World, start: Point, goal: Point, clearance: float) -> list[Point]:
    """Return the corners of the shortest way to the goal on a grid, straightened; the goal is the last corner.

    The way keeps `clearance` m from static obstacles. Without such a way the result is the goal alone.
    """
    static = [o for o in world.obstacles if o.motion is None and o.appears is None and o.vanishes is None]
    scene = Scene(static)
    cells = _search(scene, start, goal, clearance)
    return _straightened(scene, [start, *cells, goal], clearance)[1:] if cells is not None else [goal]


def _search(scene: Scene, start: Point, goal: Point, clearance: float) -> list[Point] | None:
    """Return the centres of the cells on the shortest way (A*), None if there is no way."""
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
                free[near] = _is_free(scene, (near[0] * CELL, near[1] * CELL), clearance)
            new = cost[cell] + math.hypot(di, dj)
            if free[near] and new < cost.get(near, math.inf) and math.dist(near, begin) * CELL < FAR:
                cost[near], came[near] = new, cell
                heapq.heappush(queue, (new + math.dist(near, end), near))
    return None


def _straightened(scene: Scene, way: list[Point], clearance: float) -> list[Point]:
    """Return the way without the corners that can be cut while keeping the clearance."""
    result, here = [way[0]], 0
    while here < len(way) - 1:
        reach = here + 1
        for there in range(len(way) - 1, here, -1):
            if _is_line_free(scene, way[here], way[there], clearance):
                reach = there
                break
        result.append(way[reach])
        here = reach
    return result


def _is_line_free(scene: Scene, a: Point, b: Point, clearance: float) -> bool:
    steps = max(1, math.ceil(math.dist(a, b) / (CELL / 2)))
    between = [(a[0] + (b[0] - a[0]) * i / steps, a[1] + (b[1] - a[1]) * i / steps) for i in range(1, steps)]
    return all(_is_free(scene, p, clearance) for p in between)


def _is_free(scene: Scene, p: Point, clearance: float) -> bool:
    nearest = scene.nearest(p[0], p[1], clearance)
    return nearest is None or nearest.distance >= clearance


def _cell(p: Point) -> Cell:
    return round(p[0] / CELL), round(p[1] / CELL)
