"""Read, check and write world files: the fields of a World come out, a mistake is named with its remedy."""

from __future__ import annotations

import difflib
import math
from collections.abc import Callable, Mapping
from pathlib import Path as FilePath
from typing import Any, Literal, NoReturn, cast

import yaml

from sim import gridmap
from sim.geometry import Point, Pose
from sim.obstacles import (
    Box,
    Chase,
    Circle,
    GridMap,
    Motion,
    Obstacle,
    Path,
    Polygon,
    Wall,
    When,
    room,
    signed_area,
)


class WorldError(Exception):
    """A world file cannot be used: the message names the file, the key and what to write instead."""


KINDS = {"walls": Wall, "boxes": Box, "circles": Circle, "polygons": Polygon, "maps": GridMap}


def read(path: FilePath) -> dict[str, Any]:
    """Return the fields of the World that a YAML file describes.

    Raises:
        WorldError: the file is missing, is no YAML, or has a mistake.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise WorldError(f"{path}: cannot be read ({error.strerror}). Give the path of a world file.") from error
    try:
        document = yaml.safe_load(text)
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        place = f", line {mark.line + 1}" if mark else ""
        problem = getattr(error, "problem", None) or "it is no YAML"
        raise WorldError(f"{path}{place}: {problem}. Mind the indentation, colons and brackets there.") from error
    result = fields(document, str(path), folder=path.parent)
    result.setdefault("name", path.stem)
    return result


def fields(document: Any, where: str, folder: FilePath | None) -> dict[str, Any]:
    """Return the fields of the World that plain data describe.

    `where` stands for the file in messages; map images are looked up in `folder`, and refused without one.

    Raises:
        WorldError: a key is missing, unknown or makes no sense.
    """
    top = _Node(document if document is not None else {}, where, "")
    result: dict[str, Any] = {}
    for key in ("name", "title"):
        if top.has(key):
            result[key] = top.text(key)
    if top.has("seed"):
        result["seed"] = top.whole("seed")
    result["start"] = top.pose("start") if top.has("start") else Pose()
    result["goals"] = tuple(item.as_pose() for item in top.items("goals"))
    obstacles: list[Obstacle] = []
    for item in top.items("rooms"):
        obstacles += _room(item)
    for item in top.items("walls"):
        obstacles.append(_wall(item))
    for item in top.items("boxes"):
        obstacles.append(Box(item.point("center"), item.size("size"), item.number("yaw", 0.0), **_common(item)))
    for item in top.items("circles"):
        obstacles.append(Circle(item.point("center"), item.positive("radius"), **_common(item)))
    for item in top.items("polygons"):
        obstacles.append(_polygon(item))
    for item in top.items("maps"):
        obstacles.append(_map(item, folder))
    top.no_more_keys()
    seen: dict[str, str] = {}
    for obstacle in obstacles:
        if obstacle.name and obstacle.name in seen:
            top.fail(
                "", f"two obstacles are named {obstacle.name!r}", "give each its own name; contacts are named by it"
            )
        seen[obstacle.name] = obstacle.name
    result["obstacles"] = tuple(obstacles)
    return result


def to_document(world: Mapping[str, Any]) -> dict[str, Any]:
    """Return the fields of a World as plain data that `fields` reads back."""
    document: dict[str, Any] = {key: world[key] for key in ("name", "title", "seed")}
    document["start"] = _pose_out(world["start"])
    document["goals"] = [_pose_out(goal) for goal in world["goals"]]
    for key, kind in KINDS.items():
        entries = [_obstacle_out(o) for o in world["obstacles"] if isinstance(o, kind)]
        if entries:
            document[key] = entries
    return document


def obstacle_to_document(obstacle: Obstacle) -> dict[str, Any]:
    """Return one obstacle as plain data: a document whose `fields` hold just this obstacle."""
    return {key: [_obstacle_out(obstacle)] for key, kind in KINDS.items() if isinstance(obstacle, kind)}


def _pose_out(pose: Pose) -> dict[str, float]:
    return {"x": pose.x, "y": pose.y, "yaw": pose.yaw}


def _obstacle_out(obstacle: Any) -> dict[str, Any]:
    entry: dict[str, Any] = {}
    for key, value in vars(obstacle).items():
        if key == "motion":
            if value is not None:
                entry["motion"] = {k: _plain(v) for k, v in vars(value).items() if v is not None}
                entry["motion"]["kind"] = "path" if isinstance(value, Path) else "chase"
        elif isinstance(value, Pose):
            entry[key] = _pose_out(value)
        elif value is not None and value != "":
            entry[key] = _plain(value)
    return entry


def _plain(value: Any) -> Any:
    return [_plain(v) for v in value] if isinstance(value, tuple) else value


def _room(item: _Node) -> list[Obstacle]:
    low, high, name = item.point("min"), item.point("max"), item.text("name", "")
    if not (low[0] < high[0] and low[1] < high[1]):
        item.fail("max", f"the room from {list(low)} to {list(high)} is empty", "give a corner right of and above min")
    item.no_more_keys()
    return list(room(low, high, name))


def _wall(item: _Node) -> Wall:
    start, end = item.point("start"), item.point("end")
    if start == end:
        item.fail("end", f"the wall begins and ends at {list(start)}", "give two different points")
    return Wall(start, end, item.not_negative("thickness", 0.0), **_common(item))


def _polygon(item: _Node) -> Polygon:
    points = item.points("points")
    if len(points) < 3 or signed_area(points) == 0:
        item.fail(
            "points",
            "these corners enclose no area",
            "give three corners or more, like [[0, 0], [1, 0], [0, 1]]",
        )
    if _crosses_itself(points):
        item.fail("points", "the outline crosses itself", "give the corners in the order in which one walks round it")
    return Polygon(points, **_common(item))


def _map(item: _Node, folder: FilePath | None) -> GridMap:
    if item.has("rectangles"):
        rectangles = tuple(_rectangle(part) for part in item.items("rectangles"))
        return GridMap(rectangles, item.pose("origin"), **_common(item))
    name = item.text("file")
    if folder is None:
        item.fail("file", "a map file cannot be looked up here", "load the world from its file")
    try:
        rectangles, origin = gridmap.read(folder / name)
    except gridmap.GridMapError as error:
        item.fail("file", str(error), "mend or replace that file")
    return GridMap(rectangles, origin, **_common(item))


def _rectangle(item: _Node) -> tuple[float, float, float, float]:
    values = item.value
    if not (isinstance(values, list) and len(values) == 4 and all(_is_number(v) for v in values)):
        item.fail("", f"expected [x_min, y_min, x_max, y_max], got {values!r}", "write four numbers in metres")
    x0, y0, x1, y1 = (float(v) for v in values)
    if not (x0 < x1 and y0 < y1):
        item.fail("", f"the rectangle {values!r} is empty", "write the smaller x and y first")
    return x0, y0, x1, y1


def _common(item: _Node) -> dict[str, Any]:
    common: dict[str, Any] = {
        "name": item.text("name", ""),
        "appears": item.when("appears", None),
        "vanishes": item.when("vanishes", None),
        "motion": _motion(item.child("motion")) if item.has("motion") else None,
    }
    item.no_more_keys()
    return common


def _motion(item: _Node) -> Motion:
    kind = item.choice("kind", ("path", "chase"), "path")
    speed = item.positive("speed")
    starts = cast(When, item.when("starts", 0.0))
    motion: Motion
    if kind == "chase":
        motion = Chase(speed, item.positive("standoff", 1.0), starts)
    else:
        repeat = item.choice("repeat", ("once", "loop", "back_and_forth"), "once")
        motion = Path(
            item.points("waypoints"),
            speed,
            cast(Literal["once", "loop", "back_and_forth"], repeat),
            starts,
            item.positive("wakes_within", None),
            item.positive("yields_within", None),
        )
    item.no_more_keys()
    return motion


def _crosses_itself(points: tuple[Point, ...]) -> bool:
    """Tell whether two edges of the outline that are no neighbours meet."""
    n = len(points)
    edges = [(points[i], points[(i + 1) % n]) for i in range(n)]
    return (
        any(_meet(*edges[i], *edges[j]) for i in range(n) for j in range(i + 2, n) if not (i == 0 and j == n - 1))
        or len(set(points)) < n
    )


def _meet(a: Point, b: Point, c: Point, d: Point) -> bool:
    def side(p: Point, q: Point, r: Point) -> float:
        return (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])

    if max(a[0], b[0]) < min(c[0], d[0]) or max(c[0], d[0]) < min(a[0], b[0]):
        return False
    if max(a[1], b[1]) < min(c[1], d[1]) or max(c[1], d[1]) < min(a[1], b[1]):
        return False
    return side(a, b, c) * side(a, b, d) <= 0 and side(c, d, a) * side(c, d, b) <= 0


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


class _Node:
    """One mapping or value of the file, with the place where it stands, so that every complaint can say where."""

    def __init__(self, value: Any, where: str, key: str) -> None:
        self.value = value
        self.where = where
        self.key = key
        self._known: set[str] = set()

    def fail(self, key: str, problem: str, remedy: str) -> NoReturn:
        """Raise a WorldError about a key of this node."""
        place = ".".join(part for part in (self.key, key) if part)
        raise WorldError(f"{self.where}: {place or 'the file'}: {problem}. Remedy: {remedy}.")

    def _mapping(self) -> dict[str, Any]:
        if not isinstance(self.value, dict):
            self.fail("", f"expected keys with values, got {self.value!r}", "write one `key: value` per line")
        return self.value

    def has(self, key: str) -> bool:
        self._known.add(key)
        return self._mapping().get(key) is not None

    def _get(self, key: str, kind: str, example: str, accept: Callable[[Any], bool], default: Any = ...) -> Any:
        if not self.has(key):
            if default is ...:
                self.fail(key, "is missing", f"add {kind}, for example `{key}: {example}`")
            return default
        value = self._mapping()[key]
        if not accept(value):
            self.fail(key, f"expected {kind}, got {value!r}", f"write for example `{key}: {example}`")
        return value

    def no_more_keys(self) -> None:
        """Complain about a key that nobody asked for: it is most likely a slip of the pen."""
        for key in self._mapping():
            if key not in self._known:
                near = difflib.get_close_matches(str(key), sorted(self._known), n=1)
                remedy = (
                    f"write {near[0]!r}, if that is meant"
                    if near
                    else f"remove it; keys here are {', '.join(sorted(self._known))}"
                )
                raise WorldError(
                    f"{self.where}: {self.key + '.' if self.key else ''}{key}: unknown key. Remedy: {remedy}"
                )

    def child(self, key: str) -> _Node:
        self._known.add(key)
        return _Node(self._mapping()[key], self.where, f"{self.key}.{key}" if self.key else key)

    def items(self, key: str) -> list[_Node]:
        """Return the entries of a list, none when the key is absent."""
        if not self.has(key):
            return []
        value = self._mapping()[key]
        prefix = f"{self.key}.{key}" if self.key else key
        if not isinstance(value, list):
            self.fail(key, f"expected a list, got {value!r}", f"begin each entry of {key} with `- `")
        return [_Node(entry, self.where, f"{prefix}[{i}]") for i, entry in enumerate(value)]

    def text(self, key: str, default: Any = ...) -> str:
        return str(self._get(key, "a text", "a few words", lambda v: isinstance(v, str), default))

    def whole(self, key: str) -> int:
        def accept(v: Any) -> bool:
            return isinstance(v, int) and not isinstance(v, bool) and v >= 0

        return int(self._get(key, "a whole number, 0 or more", "7", accept))

    def number(self, key: str, default: Any = ...) -> float:
        return float(self._get(key, "a number", "1.57", _is_number, default))

    def positive(self, key: str, default: Any = ...) -> Any:
        value = self._get(key, "a number above 0", "0.5", lambda v: _is_number(v) and v > 0, default)
        return None if value is None else float(value)

    def not_negative(self, key: str, default: Any = ...) -> float:
        return float(self._get(key, "a number, 0 or more", "0.1", lambda v: _is_number(v) and v >= 0, default))

    def choice(self, key: str, options: tuple[str, ...], default: str) -> str:
        return str(self._get(key, f"one of {', '.join(options)}", options[0], lambda v: v in options, default))

    def when(self, key: str, default: Any) -> When | None:
        def accept(v: Any) -> bool:
            return (isinstance(v, str) and v != "") or (_is_number(v) and v >= 0)

        value = self._get(key, "a time in seconds or the name of an event", "5.0", accept, default)
        return float(value) if _is_number(value) else cast(When | None, value)

    def point(self, key: str) -> Point:
        value = self._get(key, "two numbers in metres", "[1.0, 2.0]", _is_point)
        return float(value[0]), float(value[1])

    def size(self, key: str) -> tuple[float, float]:
        value = self._get(key, "two numbers above 0, in metres", "[0.4, 0.3]", lambda v: _is_point(v) and min(v) > 0)
        return float(value[0]), float(value[1])

    def points(self, key: str) -> tuple[Point, ...]:
        def accept(v: Any) -> bool:
            return isinstance(v, list) and len(v) > 0 and all(_is_point(p) for p in v)

        value = self._get(key, "a list of points in metres", "[[1.0, 0.0], [2.0, 0.5]]", accept)
        return tuple((float(p[0]), float(p[1])) for p in value)

    def pose(self, key: str) -> Pose:
        self._get(key, "a pose", "{x: 1.0, y: 2.0, yaw: 0.0}", lambda _: True)
        return self.child(key).as_pose()

    def as_pose(self) -> Pose:
        """Return this node as {x, y, yaw} (yaw in radians, 0 when absent)."""
        pose = Pose(self.number("x"), self.number("y"), self.number("yaw", 0.0))
        self.no_more_keys()
        return pose


def _is_point(value: Any) -> bool:
    return isinstance(value, list) and len(value) == 2 and all(_is_number(v) for v in value)
