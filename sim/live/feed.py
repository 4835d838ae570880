"""What a browser must know about a simulator: everything once, then what changed. The protocol of view.js."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from sim.geometry import Point, Pose
from sim.live.drivers import CONTROL_S
from sim.obstacles import Box, Circle, CirclePart, Obstacle, Path, Polygon, PolygonPart, SegmentPart
from sim.simulator import Simulator
from sim.views import COLORS

PROTOCOL = 1
MAX_BEAMS = 180
MAX_PATH = 4000  # points; beyond it every second one is left out
PATH_M = 0.02  # a point of the path is kept when it is so far from the last
NO_RANGE = 65535  # centimetres on the wire: nothing seen

Message = dict[str, Any]


class Feed:
    """What the browser must know about a simulator: everything once, then what changed.

    Places are metres in the map frame, rounded to millimetres; the scan travels beside the message, as centimetres in
    16 bits, `NO_RANGE` for a beam without a valid reading.
    """

    def __init__(self, simulator: Simulator) -> None:
        self._simulator = simulator
        self._stride = max(1, math.ceil(simulator.profile.lidar.beams.count / MAX_BEAMS))
        self._told: dict[str, tuple[Obstacle, Point]] = {}
        self._contacts_told = self._path_told = 0
        self._scene_due = True
        self.path: list[Point] = []
        """Where the robot has been since the last reset, map frame, m."""
        self._time = -math.inf
        self.follow()

    def follow(self) -> None:
        """Take down the path; to be called after every step. A simulator that was reset begins a new one."""
        sim = self._simulator
        if sim.time < self._time:
            self.path = []
            self.begin()
        self._time = sim.time
        place = (sim.pose.x, sim.pose.y)
        if not self.path or math.dist(self.path[-1], place) >= PATH_M:
            self.path.append(place)
        if len(self.path) > MAX_PATH:
            self.path = self.path[::2]
            self._path_told = 0

    def begin(self) -> None:
        """Say everything again with the next message: a view has been opened, or time has gone back."""
        self._scene_due = True
        self._told = {}
        self._contacts_told = self._path_told = 0

    def message(self) -> tuple[Message, bytes]:
        """Return what changed since the last call, and the scan as it is now."""
        self.follow()
        sim = self._simulator
        pose, twist, command = sim.pose, sim.twist, sim.commanded
        sensor = pose.compose(sim.profile.lidar.pose)
        message: Message = {
            "t": round(sim.time, 3),
            "pose": [*_millimetres(pose.x, pose.y), round(pose.yaw, 4)],
            "sensor": [*_millimetres(sensor.x, sensor.y), round(sensor.yaw, 4)],
            "twist": [round(twist.v, 3), round(twist.omega, 3)],
            "command": [round(command.v, 3), round(command.omega, 3)],
            "clearance": _finite(sim.clearance()),
            "touching": sim.in_contact,
        }
        if self._scene_due:
            self._scene_due = False
            message["scene"] = self._scene()
        self._add_obstacles(message)
        if self._path_told < len(self.path):
            # The index from which on the points replace those that the view has, then x, y, x, y ...
            points = [value for p in self.path[self._path_told :] for value in _millimetres(*p)]
            message["path"] = [self._path_told, *points]
            self._path_told = len(self.path)
        if contacts := sim.contacts[self._contacts_told :]:
            message["contacts"] = [[*_millimetres(*c.point), round(c.time, 2), c.obstacle] for c in contacts]
            self._contacts_told += len(contacts)
        return message, _centimetres(sim.scan().ranges[:: self._stride])

    def _scene(self) -> Message:
        sim, beams = self._simulator, self._simulator.profile.lidar.beams
        return {
            "protocol": PROTOCOL,
            "world": sim.world.name,
            "title": sim.world.title,
            "radius": sim.profile.radius,
            "angle_min": beams.angle_min,
            "increment": beams.increment * self._stride,
            "full_circle": beams.is_full_circle,
            "bounds": _bounds(sim),
            "goals": [_millimetres(g.x, g.y) for g in sim.world.goals],
            "colors": COLORS,
            "step_s": CONTROL_S,
        }

    def _add_obstacles(self, message: Message) -> None:
        """Put in the obstacles that are new, those that moved, and the names of those that have gone."""
        there = {obstacle.name: (obstacle, place) for obstacle, place in self._simulator.obstacles}
        new, moved = [], {}
        for name, (obstacle, place) in there.items():
            told = self._told.get(name)
            if told is None or told[0] is not obstacle:
                new.append(_shape(obstacle, place))
            elif told[1] != place:
                moved[name] = _millimetres(*place)
        gone = [name for name in self._told if name not in there]
        self._told = there
        for key, value in (("new", new), ("moved", moved), ("gone", gone)):
            if value:
                message[key] = value


def can_be_dragged(obstacle: Obstacle) -> bool:
    """Walls and maps stay: they are the building."""
    return isinstance(obstacle, Box | Circle | Polygon)


def _shape(obstacle: Obstacle, place: Point) -> Message:
    """Return an obstacle as plain data: its parts relative to its centre, axes along the map's."""
    turned = Pose(0.0, 0.0, obstacle.pose.yaw).point_to_parent
    parts: list[list[float]] = []
    for part in obstacle.parts():
        match part:
            case SegmentPart():
                parts.append([*_millimetres(*turned(part.start)), *_millimetres(*turned(part.end))])
            case CirclePart():
                parts.append([*_millimetres(*turned(part.center)), round(part.radius, 3)])
            case PolygonPart():
                parts.append([value for corner in part.corners for value in _millimetres(*turned(corner))])
    return {
        "name": obstacle.name,
        "at": _millimetres(*place),
        "parts": parts,  # 3 numbers a circle, 4 a line, 6 and more a polygon
        "moves": obstacle.motion is not None,
        "drag": can_be_dragged(obstacle),
    }


def _bounds(simulator: Simulator, reach: float = 8.0, margin: float = 0.4) -> list[float]:
    """Return x, y of the lower left and of the upper right corner of what to show, in m; what is far off is cut."""
    world = simulator.world
    places = [(p.x, p.y) for p in (world.start, simulator.pose, *world.goals)]
    low, high = np.min(places, axis=0) - reach, np.max(places, axis=0) + reach
    places += [corner for obstacle in world.obstacles for corner in _corners(obstacle)]
    if not world.obstacles:
        margin = 2.0
    x0, y0 = np.maximum(np.min(places, axis=0), low) - margin
    x1, y1 = np.minimum(np.max(places, axis=0), high) + margin
    return [round(float(value), 2) for value in (x0, y0, x1, y1)]


def _corners(obstacle: Obstacle) -> list[Point]:
    """Return points of an obstacle's outline in the map frame, and of the way that it goes."""
    found = list(obstacle.motion.waypoints) if isinstance(obstacle.motion, Path) else []
    for part in obstacle.parts():
        match part:
            case SegmentPart():
                corners: tuple[Point, ...] = (part.start, part.end)
            case CirclePart():
                (x, y), r = part.center, part.radius
                corners = ((x - r, y), (x + r, y), (x, y - r), (x, y + r))
            case PolygonPart():
                corners = part.corners
        found += [obstacle.pose.point_to_parent(corner) for corner in corners]
    return found


def _millimetres(x: float, y: float) -> list[float]:
    return [round(x, 3), round(y, 3)]


def _finite(value: float) -> float | None:
    return round(value, 3) if math.isfinite(value) else None


def _centimetres(ranges: Any) -> bytes:
    valid = np.isfinite(ranges)
    centimetres = np.clip(np.round(np.where(valid, ranges, 0.0) * 100), 0, NO_RANGE - 1)
    return np.where(valid, centimetres, NO_RANGE).astype("<u2").tobytes()
