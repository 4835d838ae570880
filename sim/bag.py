"""Write a recording as rosbag2 (MCAP), for Foxglove and `ros2 bag`. Needs `rosbags` but no ROS installation."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from sim.obstacles import CirclePart, PolygonPart, SegmentPart
from sim.recording import Recording
from sim.robot import PROFILES

Fields = Mapping[str, Any]


@dataclass(frozen=True)
class BagMessage:
    """An additional message for the bag: topic, type ("pkg/msg/Name"), simulated time in s, fields as nested mappings.

    Missing fields are zero, empty or false.
    """

    topic: str
    type: str
    time: float
    fields: Fields = field(default_factory=dict)


def write_bag(
    recording: Recording,
    path: str | Path,
    types: Mapping[str, str] | None = None,
    messages: Iterable[BagMessage] = (),
) -> None:
    """Write the recording as a rosbag2 folder with one MCAP file.

    `types` maps custom message types ("pkg/msg/Name") that `messages` use to the text of their .msg files. The bag
    holds scan, odom, cmd_vel, tf, the true pose, contacts and the world's outline; stamps are simulated time.

    Raises:
        FileExistsError: `path` exists.
        KeyError: a message has an unknown type or field.
    """
    path = Path(path)
    if path.exists():
        raise FileExistsError(f"{path} exists; choose another path for the bag, or remove it")
    store = get_typestore(Stores.ROS2_JAZZY)
    for name, text in (types or {}).items():
        store.register(get_types_from_msg(text, name))
    everything = sorted([*_of_recording(recording), *messages], key=lambda message: message.time)
    writer = Writer(path, version=9, storage_plugin=StoragePlugin.MCAP)
    writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
    with writer:
        connections: dict[str, Any] = {}
        for message in everything:
            if message.topic not in connections:
                connections[message.topic] = writer.add_connection(message.topic, message.type, typestore=store)
            data = store.serialize_cdr(_filled(store, message.type, message.fields), message.type)
            writer.write(connections[message.topic], _nanoseconds(message.time), data)


def _of_recording(r: Recording) -> Iterable[BagMessage]:
    profile = PROFILES.get(r.profile)
    lidar_frame = profile.lidar.frame if profile else "laser"
    yield BagMessage("/world", "visualization_msgs/msg/Marker", 0.0, _outline(r))
    origin = r.odom_origin
    for i, t in enumerate(r.t.tolist()):
        x, y, yaw = (float(r.samples[c][i]) for c in ("odom_x", "odom_y", "odom_yaw"))
        twist = {"linear": {"x": float(r.v[i])}, "angular": {"z": float(r.omega[i])}}
        pose = {"position": {"x": x, "y": y}, "orientation": _quaternion(yaw)}
        head = _header(t, "odom")
        odom = {"header": head, "child_frame_id": "base_link", "pose": {"pose": pose}, "twist": {"twist": twist}}
        yield BagMessage("/odom", "nav_msgs/msg/Odometry", t, odom)
        true = r.pose_at(i)
        true_pose = {"position": {"x": true.x, "y": true.y}, "orientation": _quaternion(true.yaw)}
        yield BagMessage(
            "/ground_truth/pose", "geometry_msgs/msg/PoseStamped", t, {"header": _header(t, "map"), "pose": true_pose}
        )
        transforms = [
            _transform(t, "map", "odom", origin.x, origin.y, origin.yaw),
            _transform(t, "odom", "base_link", x, y, yaw),
            _transform(t, "base_link", lidar_frame, r.lidar.x, r.lidar.y, r.lidar.yaw),
        ]
        yield BagMessage("/tf", "tf2_msgs/msg/TFMessage", t, {"transforms": transforms})
        command = {"linear": {"x": float(r.cmd_v[i])}, "angular": {"z": float(r.cmd_omega[i])}}
        if profile and profile.stamped_cmd_vel:
            stamped = {"header": _header(t, "base_link"), "twist": command}
            yield BagMessage("/cmd_vel", "geometry_msgs/msg/TwistStamped", t, stamped)
        else:
            yield BagMessage("/cmd_vel", "geometry_msgs/msg/Twist", t, command)
    for t, ranges in zip(r.scan_t.tolist(), r.scan_ranges, strict=True):
        scan = {
            "header": _header(t, lidar_frame),
            "angle_min": float(r.scan_angles[0]),
            "angle_max": float(r.scan_angles[-1]),
            "angle_increment": float(r.scan_angles[1] - r.scan_angles[0]),
            "range_min": profile.lidar.range_min if profile else 0.0,
            "range_max": profile.lidar.beams.range_max if profile else math.inf,
            "ranges": ranges.astype(np.float32),
        }
        yield BagMessage("/scan", "sensor_msgs/msg/LaserScan", t, scan)
    for c in r.contacts:
        text = f"touched {c.obstacle} at ({c.point[0]:.3f}, {c.point[1]:.3f}), moving at {c.speed:.2f} m/s"
        yield BagMessage("/ground_truth/contacts", "std_msgs/msg/String", c.time, {"data": text})


def _outline(r: Recording) -> Fields:
    """Return the world as a marker of lines (LINE_LIST) in the map frame."""
    points: list[Fields] = []
    for obstacle in r.world.obstacles:
        place = obstacle.pose.point_to_parent
        for part in obstacle.parts():
            match part:
                case SegmentPart():
                    ring = [part.start, part.end]
                case PolygonPart():
                    ring = [*part.corners, part.corners[0]]
                case CirclePart():
                    (x, y), radius = part.center, part.radius
                    angles = [k * math.tau / 24 for k in range(25)]
                    ring = [(x + radius * math.cos(a), y + radius * math.sin(a)) for a in angles]
            for a, b in itertools.pairwise(ring):
                points += [dict(zip("xy", place(a), strict=True)), dict(zip("xy", place(b), strict=True))]
    grey = {"r": 0.49, "g": 0.52, "b": 0.56, "a": 1.0}
    upright = {"orientation": {"w": 1.0}}
    line_list, thickness = 5, {"x": 0.03}
    return {
        "header": _header(0.0, "map"), "ns": "world", "type": line_list, "pose": upright, "scale": thickness,
        "color": grey, "points": points,
    }  # fmt: skip


def _header(t: float, frame: str) -> Fields:
    seconds, nanoseconds = divmod(_nanoseconds(t), 10**9)
    return {"stamp": {"sec": seconds, "nanosec": nanoseconds}, "frame_id": frame}


def _nanoseconds(t: float) -> int:
    return round(t * 1e9)


def _quaternion(yaw: float) -> Fields:
    return {"z": math.sin(yaw / 2), "w": math.cos(yaw / 2)}


def _transform(t: float, parent: str, child: str, x: float, y: float, yaw: float) -> Fields:
    moved = {"translation": {"x": x, "y": y}, "rotation": _quaternion(yaw)}
    return {"header": _header(t, parent), "child_frame_id": child, "transform": moved}


def _filled(store: Any, name: str, given: Fields) -> Any:
    """Return a message of the type with the given fields; all others have their default."""
    definitions = store.fielddefs[name][1]
    known = {key for key, _ in definitions}
    if unknown := set(given) - known:
        raise KeyError(f"{name} has no field {sorted(unknown)[0]!r}; it has {', '.join(sorted(known))}")
    return store.types[name](**{key: _value(store, kind, given.get(key)) for key, kind in definitions})


def _value(store: Any, kind: Any, given: Any) -> Any:
    node, detail = kind
    match node.name:
        case "BASE":
            base = detail[0]
            if base == "string":
                return "" if given is None else str(given)
            return (bool if base == "bool" else float if base.startswith("float") else int)(given or 0)
        case "NAME":
            return _filled(store, detail, given or {})
        case _:
            element, length = detail
            count = length if node.name == "ARRAY" else 0
            if element[0].name == "BASE" and element[1][0] != "string":
                return np.asarray([0] * count if given is None else given, dtype=element[1][0])
            return [_value(store, element, item) for item in ([None] * count if given is None else given)]
