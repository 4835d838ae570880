"""Read and write world files: their schema, from YAML to the fields of a World and back."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path as FilePath
from typing import Any, Literal, cast

import yaml

from sim.geometry import Pose
from sim.obstacles import Box, Circle, Obstacle, Path, Polygon, Wall, When, room
from sim.polygon import crosses_itself, signed_area
from sim.validation import Item, WorldError

KINDS = {"walls": Wall, "boxes": Box, "circles": Circle, "polygons": Polygon}


def read(path: FilePath) -> dict[str, Any]:
    """Return the fields of the World that a YAML file describes.

    Raises:
        WorldError: the file is missing, is not YAML, or has a mistake.
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
        problem = getattr(error, "problem", None) or "it is not YAML"
        raise WorldError(f"{path}{place}: {problem}. Check the indentation, colons and brackets there.") from error
    result = parse(document, str(path))
    result.setdefault("name", path.stem)
    return result


def parse(document: Any, where: str) -> dict[str, Any]:
    """Return the fields of the World that plain data describe. `where` names the file in messages.

    Raises:
        WorldError: a key is missing or unknown, or its value is invalid.
    """
    top = Item(document if document is not None else {}, where, "")
    result: dict[str, Any] = {}
    for key in ("name", "title"):
        if top.has(key):
            result[key] = top.text(key)
    if top.has("seed"):
        result["seed"] = top.integer("seed")
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
    top.refuse_other_keys()
    names: set[str] = set()
    for name in (obstacle.name for obstacle in obstacles if obstacle.name):
        if name in names:
            top.fail("", f"two obstacles are named {name!r}", "give each its own name; contacts are recorded by name")
        names.add(name)
    result["obstacles"] = tuple(obstacles)
    return result


def to_document(world: Mapping[str, Any]) -> dict[str, Any]:
    """Return the fields of a World as plain data that `parse` reads back."""
    document: dict[str, Any] = {key: world[key] for key in ("name", "title", "seed")}
    document["start"] = _pose_out(world["start"])
    document["goals"] = [_pose_out(goal) for goal in world["goals"]]
    for key, kind in KINDS.items():
        entries = [_obstacle_out(o) for o in world["obstacles"] if isinstance(o, kind)]
        if entries:
            document[key] = entries
    return document


def _pose_out(pose: Pose) -> dict[str, float]:
    return {"x": pose.x, "y": pose.y, "yaw": pose.yaw}


def _obstacle_out(obstacle: Any) -> dict[str, Any]:
    entry: dict[str, Any] = {}
    for key, value in vars(obstacle).items():
        if key == "motion":
            if value is not None:
                entry["motion"] = {k: _plain(v) for k, v in vars(value).items() if v is not None}
        elif isinstance(value, Pose):
            entry[key] = _pose_out(value)
        elif value is not None and value != "":
            entry[key] = _plain(value)
    return entry


def _plain(value: Any) -> Any:
    return [_plain(v) for v in value] if isinstance(value, tuple) else value


def _room(item: Item) -> list[Obstacle]:
    low, high, name = item.point("min"), item.point("max"), item.text("name", "")
    if not (low[0] < high[0] and low[1] < high[1]):
        item.fail("max", f"the room from {list(low)} to {list(high)} is empty", "give a corner right of and above min")
    item.refuse_other_keys()
    return list(room(low, high, name))


def _wall(item: Item) -> Wall:
    start, end = item.point("start"), item.point("end")
    if start == end:
        item.fail("end", f"the wall starts and ends at {list(start)}", "give two different points")
    return Wall(start, end, item.non_negative("thickness", 0.0), **_common(item))


def _polygon(item: Item) -> Polygon:
    points = item.points("points")
    if len(points) < 3 or signed_area(points) == 0:
        item.fail(
            "points",
            "these corners enclose no area",
            "give three corners or more, for example [[0, 0], [1, 0], [0, 1]]",
        )
    if crosses_itself(points):
        item.fail("points", "the outline crosses itself", "give the corners in order around the outline")
    return Polygon(points, **_common(item))


def _common(item: Item) -> dict[str, Any]:
    common: dict[str, Any] = {
        "name": item.text("name", ""),
        "appears": item.when("appears", None),
        "vanishes": item.when("vanishes", None),
        "motion": _motion(item.child("motion")) if item.has("motion") else None,
    }
    item.refuse_other_keys()
    return common


def _motion(item: Item) -> Path:
    item.choice("kind", ("path",), "path")  # in files of older versions
    motion = Path(
        speed=item.positive("speed"),
        starts=cast(When, item.when("starts", 0.0)),
        repeat=cast(
            Literal["once", "loop", "back_and_forth"],
            item.choice("repeat", ("once", "loop", "back_and_forth"), "once"),
        ),
        waypoints=item.points("waypoints"),
        wakes_within=item.positive("wakes_within", None),
        yields_within=item.positive("yields_within", None),
    )
    item.refuse_other_keys()
    return motion
