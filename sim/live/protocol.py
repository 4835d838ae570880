"""The messages between the kernel and view.js: the state sent to the browser, and the commands accepted from it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from sim.drive import CONTROL_S
from sim.geometry import Point, Pose
from sim.obstacles import Box, Circle, CirclePart, Obstacle, Path, Polygon, PolygonPart, SegmentPart, extreme_points
from sim.simulator import Simulator
from sim.views import COLORS

PROTOCOL = 1
MAX_BEAMS = 180
MAX_PATH = 4000  # points; a longer path loses every second one
PATH_M = 0.02  # spacing of the path's points
NO_RANGE = 65535  # what a beam without a valid reading is sent as

Message = dict[str, Any]


class Feed:
    """The state of a simulator as messages: the full state first, then only the changes.

    Positions are in metres in the map frame, rounded to millimetres. The scan is sent beside the message as 16-bit
    integers in centimetres, `NO_RANGE` for a beam without a valid reading.
    """

    def __init__(self, simulator: Simulator) -> None:
        self._simulator = simulator
        self._stride = max(1, math.ceil(simulator.profile.lidar.beams.count / MAX_BEAMS))
        self._sent: dict[str, tuple[Obstacle, Point]] = {}
        self._contacts_sent = self._path_sent = 0
        self._scene_due = True
        self.path: list[Point] = []
        """Where the robot has been since the last reset, map frame, m."""
        self._time = -math.inf
        self.follow()

    def follow(self) -> None:
        """Record the path; call this after every step. A simulator that has been reset starts a new path."""
        sim = self._simulator
        if sim.time < self._time:
            self.path = []
            self.restart()
        self._time = sim.time
        place = (sim.pose.x, sim.pose.y)
        if not self.path or math.dist(self.path[-1], place) >= PATH_M:
            self.path.append(place)
        if len(self.path) > MAX_PATH:
            self.path = self.path[::2]
            self._path_sent = 0

    def restart(self) -> None:
        """Send the full state with the next message, because a view has opened or time has gone back."""
        self._scene_due = True
        self._sent = {}
        self._contacts_sent = self._path_sent = 0

    def message(self) -> tuple[Message, bytes]:
        """Return the changes since the last call, and the current scan."""
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
        if self._path_sent < len(self.path):
            # The index of the first point to replace in the view, then x, y, x, y ...
            points = [value for p in self.path[self._path_sent :] for value in _millimetres(*p)]
            message["path"] = [self._path_sent, *points]
            self._path_sent = len(self.path)
        if contacts := sim.contacts[self._contacts_sent :]:
            message["contacts"] = [[*_millimetres(*c.point), round(c.time, 2), c.obstacle] for c in contacts]
            self._contacts_sent += len(contacts)
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
        """Add the new obstacles, the moved ones, and the names of the removed ones."""
        present = {obstacle.name: (obstacle, place) for obstacle, place in self._simulator.obstacles}
        new, moved = [], {}
        for name, (obstacle, place) in present.items():
            sent = self._sent.get(name)
            if sent is None or sent[0] is not obstacle:
                new.append(_shape(obstacle, place))
            elif sent[1] != place:
                moved[name] = _millimetres(*place)
        gone = [name for name in self._sent if name not in present]
        self._sent = present
        for key, value in (("new", new), ("moved", moved), ("gone", gone)):
            if value:
                message[key] = value


def can_be_dragged(obstacle: Obstacle) -> bool:
    """Return whether the mouse can move an obstacle. Walls and maps are the building and stay in place."""
    return isinstance(obstacle, Box | Circle | Polygon)


def parse_command(content: object) -> Message | None:
    """Return the command in a browser's message, None if it is not a valid one. The message is not trusted."""
    if not isinstance(content, Mapping):
        return None
    kind = content.get("kind")
    if kind in ("run", "pause", "step", "reset"):
        return {"kind": kind}
    if kind in ("hello", "bye", "alive") and isinstance(content.get("view"), str):
        return {"kind": kind, "view": content["view"], "hidden": content.get("hidden") is True}
    if kind == "rate":
        value = content.get("value")
        rate = math.inf if value is None else _number(value)
        return {"kind": kind, "value": rate} if rate is not None and rate > 0 else None
    if kind in ("goal", "move"):
        x, y = _number(content.get("x")), _number(content.get("y"))
        if x is None or y is None:
            return None
        if kind == "goal":
            return {"kind": kind, "x": x, "y": y}
        if isinstance(content.get("name"), str):
            return {"kind": kind, "name": content["name"], "x": x, "y": y}
    return None


def _number(value: object) -> float | None:
    fits = isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < 1e4
    return float(value) if fits else None  # type: ignore[arg-type]  # `fits` has checked the type


def _shape(obstacle: Obstacle, place: Point) -> Message:
    """Return an obstacle as plain data: its parts relative to its centre, with axes parallel to the map's."""
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
        "parts": parts,  # 3 numbers are a circle, 4 a line, 6 or more a polygon
        "moves": obstacle.motion is not None,
        "drag": can_be_dragged(obstacle),
    }


def _bounds(simulator: Simulator, reach: float = 8.0, margin: float = 0.4) -> list[float]:
    """Return x_min, y_min, x_max, y_max of the map to show, in m: up to `reach` from the robot and its goals."""
    world = simulator.world
    places = [(p.x, p.y) for p in (world.start, simulator.pose, *world.goals)]
    low, high = np.min(places, axis=0) - reach, np.max(places, axis=0) + reach
    for obstacle in world.obstacles:
        places += obstacle.motion.waypoints if isinstance(obstacle.motion, Path) else ()
        places += extreme_points(obstacle)
    if not world.obstacles:
        margin = 2.0
    x0, y0 = np.maximum(np.min(places, axis=0), low) - margin
    x1, y1 = np.minimum(np.max(places, axis=0), high) + margin
    return [round(float(value), 2) for value in (x0, y0, x1, y1)]


def _millimetres(x: float, y: float) -> list[float]:
    return [round(x, 3), round(y, 3)]


def _finite(value: float) -> float | None:
    return round(value, 3) if math.isfinite(value) else None


def _centimetres(ranges: Any) -> bytes:
    valid = np.isfinite(ranges)
    centimetres = np.clip(np.round(np.where(valid, ranges, 0.0) * 100), 0, NO_RANGE - 1)
    return np.where(valid, centimetres, NO_RANGE).astype("<u2").tobytes()
