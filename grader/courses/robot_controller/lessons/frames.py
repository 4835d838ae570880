"""Transforms as messages and as numbers, for the notebook on frames, and `check`, which tries what learners write."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np
from builtin_interfaces.msg import Time
from geometry_msgs.msg import TransformStamped, Twist, TwistStamped
from numpy.typing import NDArray
from sensor_msgs.msg import LaserScan

from grader.notebook.feedback import Checked
from grader.notebook.tables import Findings, answered, shown
from grader.notebook.workspace import course
from grader.words import mark, say
from sim import TB4, Pose, Simulator, load_world, normalize_angle
from sim.messages import to_message

_BASE = "base_link"

Place = tuple[float, float, float]
"""x and y in metres and the yaw in radians of one frame in another."""


class ExtrapolationException(Exception):
    """A transform was asked for at a time outside of those that are known. The name is tf2's."""


def transform(parent: str, child: str, time: float, place: Place) -> TransformStamped:
    """Return the message that says where `child` is in `parent` at `time` (s)."""
    message = TransformStamped(child_frame_id=child)
    message.header.frame_id = parent
    message.header.stamp.sec, message.header.stamp.nanosec = divmod(round(time * 1e9), 1_000_000_000)
    x, y, yaw = (float(value) for value in place)
    message.transform.translation.x, message.transform.translation.y = x, y
    message.transform.rotation.z, message.transform.rotation.w = math.sin(yaw / 2), math.cos(yaw / 2)
    return message


def place(message: TransformStamped) -> Place:
    """Return x, y and yaw of the transform in a message."""
    shift, turn = message.transform.translation, message.transform.rotation
    return shift.x, shift.y, 2 * math.atan2(turn.z, turn.w)


def seconds(message: TransformStamped) -> float:
    """Return the stamp of a message in seconds."""
    return float(message.header.stamp.sec + message.header.stamp.nanosec * 1e-9)


def read_bag(folder: str | Path, topic: str) -> list[Any]:
    """Return the messages on a topic of a bag, in the order in which they were written."""
    from rclpy.serialization import deserialize_message
    from rosbags.rosbag2 import Reader

    from grader.trials.messages import interface

    with Reader(folder) as bag:
        wanted = [connection for connection in bag.connections if connection.topic == topic]
        raw = [(connection.msgtype, data) for connection, _, data in bag.messages(connections=wanted)]
    return [deserialize_message(data, interface(kind)) for kind, data in raw]


def check(task: str, *written: Callable[..., Any]) -> Checked:
    """Try the learner's functions of a task ("TF1") on cases that the notebook does not show."""
    look = say("run the table of cases above: which row says the same?")
    return answered(task, _TASKS[task](*written), look)


def _compose_and_invert(compose: Callable[..., Any], inverse: Callable[..., Any]) -> Findings:
    for a, b in zip(_places(20, seed=1), _places(20, seed=2), strict=True):
        wanted = _place(Pose(*a).compose(Pose(*b)))
        if not _same(got := compose(a, b), wanted):
            look = say("turn b's x and y by a's yaw before you add a's x and y")
            yield _gave(f"compose({shown(a)}, {shown(b)})", got), shown(wanted), look
        if not _same(got := inverse(a), wanted := _place(Pose(*a).inverse())):
            look = say("the shift of the inverse is -x and -y, turned by -yaw")
            yield _gave(f"inverse({shown(a)})", got), shown(wanted), look


def _gave(call: str, got: object) -> str:
    return say("{call} is {got}", call=call, got=shown(got))


def _at(at: Callable[..., Any]) -> Findings:
    random = np.random.default_rng(3)
    for before, after in zip(_places(20, seed=4), _places(20, seed=5), strict=True):
        start = float(random.uniform(0.0, 1e4))
        times = [start, start + 0.05, start + 0.1]
        messages = [transform("odom", "base_link", t, p) for t, p in zip(times, (after, before, after), strict=True)]
        share = float(random.choice([0.0, 0.2, 0.5, 0.9]))
        turn = normalize_angle(after[2] - before[2])
        wanted = (*(b + share * (a - b) for a, b in zip(after[:2], before[:2], strict=True)), before[2] + share * turn)
        got = at(messages, times[1] + share * 0.05)
        if not _same(got, wanted, within=1e-4):  # a stamp of some thousand seconds, as a float
            words = mark("{share:.0%} of the way from {before} to {after} you answer {got}")
            said = say(words, share=share, before=shown(before), after=shown(after), got=shown(got))
            yield said, shown(wanted), say("which two messages are around the time? And the yaw takes the short way")
        early = mark("0.01 s before the first message you answer {got}")
        late = mark("0.01 s after the last message you answer {got}")
        for time, seen in ((start - 0.01, early), (start + 0.11, late)):
            with suppress(ExtrapolationException):
                got = at(messages, time)
                look = say("compare the time with the first and the last stamp before all else")
                yield say(seen, got=shown(got)), say("an ExtrapolationException"), look


class _Tree:
    """A buffer whose frames do not move; `unknown` is one that must not be asked for."""

    def __init__(self, parent: dict[str, str], places: list[Place], unknown: str = "") -> None:
        self.parent = parent
        self._places = dict(zip(parent, places, strict=True))
        self._unknown = unknown

    def placed(self, child: str, time: float) -> Place:
        if child == self._unknown:
            words = mark("where {child} is in {parent} at {time:g} s is not known")
            raise ExtrapolationException(say(words, child=child, parent=self.parent[child], time=time))
        return self._places[child]

    def in_root(self, frame: str) -> Pose:
        """Return a frame's place in the frame that has no parent."""
        return self.in_root(self.parent[frame]).compose(Pose(*self._places[frame])) if frame in self.parent else Pose()


_PARENTS = {"odom": "map", "base_link": "odom", "laser": "base_link", "mast": "base_link", "camera": "mast"}


def _lookup(lookup: Callable[..., Any]) -> Findings:
    tree = _Tree(_PARENTS, _places(len(_PARENTS), seed=6))
    frames = ["map", *_PARENTS]
    for target, source in ((target, source) for target in frames for source in frames):
        wanted = _place(tree.in_root(target).inverse().compose(tree.in_root(source)))
        if not _same(got := lookup(tree, target, source, 1.0), wanted):
            way = say("target first: where is `source`, seen from `target`?")
            yield _gave(f"lookup(..., {target!r}, {source!r}, ...)", got), shown(wanted), way
    still = _Tree(_PARENTS, _places(len(_PARENTS), seed=6), unknown="base_link")
    try:
        lookup(still, "laser", "camera", 99.0)
    except ExtrapolationException as error:
        seen = say("the camera, seen from the laser: {error}", error=error)
        look = say("climb no higher than the first frame that both have above")
        yield seen, say("an answer: both are bolted to base_link"), look
    apart = _Tree({"laser": "base_link", "tool": "arm"}, _places(2, seed=7))
    try:
        got = lookup(apart, "laser", "tool", 1.0)
    except Exception:  # tf2 has a name for it, and any will do here
        return
    seen = say("for two frames of different trees you answer {got}", got=shown(got))
    yield seen, say("an exception"), say("what if none is above both?")


def _adapt(stamped: Callable[..., Any], turned: Callable[..., Any], names: Callable[..., Any]) -> Findings:
    command, now = Twist(), Time(sec=12, nanosec=500_000_000)
    command.linear.x, command.angular.z = 0.17, -0.4
    got = stamped(command, now)
    if not isinstance(got, TwistStamped) or got.twist != command:
        look = say("a TwistStamped whose twist is v = 0.17, omega = -0.4")
        yield _gave("stamped(...)", got), look, say("give the twist to TwistStamped when you make it")
    else:
        yield from _header(got, now, say("the header has two fields that you set"))
    scan: Any = to_message(Simulator(load_world("office"), TB4, seed=8).scan())
    before = deepcopy(scan)
    for yaw in (math.pi / 2, 0.7):
        got = turned(scan, yaw)
        if scan != before:
            yield say("you have changed the scan that came in"), say("a copy with other angles"), "copy.deepcopy(scan)"
        if not isinstance(got, LaserScan) or len(got.ranges) != len(scan.ranges):
            look = say("a LaserScan with {count} readings", count=len(scan.ranges))
            yield _gave("turned(...)", got), look, say("return the copy")
            return
        if not np.allclose(_points(got, 0.0), _points(scan, yaw), atol=1e-3):
            seen = say("for a lidar turned by {yaw:.2f} rad, the readings lie elsewhere around the robot", yaw=yaw)
            look = say("is yaw added or subtracted? At both ends of the angles?")
            yield seen, say("each reading where it was measured"), look
        yield from _header(got, scan.header.stamp, say("the stamp stays, the frame does not"))
    commands = [node.command for node in course().nodes.values() if node.command]
    for namespace in ("", "/robot1"):
        robots = {"imu/data": "imu", "battery/state": "battery_state"}
        wanted = {name: f"{namespace}/{robots.get(name, name)}" for name in ("scan", *commands, "odom", *robots)}
        if (given := names(namespace)) != wanted:
            look = say("a full name is the namespace, a slash and the name")
            yield _gave(f"names({namespace!r})", given), shown(wanted), look


def _header(got: Any, stamp: Time, look: str) -> Findings:
    if (got.header.stamp, got.header.frame_id) != (stamp, _BASE):
        said = say("the stamp is {time} s, the frame {frame}", time=got.header.stamp.sec, frame=got.header.frame_id)
        yield said, f"{stamp.sec} s, {_BASE}", look


def _points(scan: LaserScan, yaw: float) -> NDArray[np.float64]:
    """Return x and y of each finite reading in the frame in which the scan's is turned by `yaw`, in a fixed order."""
    step = scan.angle_increment
    angles = np.mod(scan.angle_min + yaw + step * np.arange(len(scan.ranges)) + step / 2, math.tau) - step / 2
    order = np.argsort(angles)
    ranges = np.nan_to_num(np.asarray(scan.ranges, float)[order], posinf=0.0)
    return np.stack([ranges * np.cos(angles[order]), ranges * np.sin(angles[order])])


_TASKS: dict[str, Callable[..., Findings]] = {"TF1": _compose_and_invert, "TF2": _at, "TF3": _lookup, "TF4": _adapt}


def _places(count: int, seed: int) -> list[Place]:
    random = np.random.default_rng(seed)
    return [(round(x, 2), round(y, 2), round(yaw, 2)) for x, y, yaw in random.uniform(-3.1, 3.1, (count, 3)).tolist()]


def _place(pose: Pose) -> Place:
    return pose.x, pose.y, pose.yaw


def _same(got: Any, wanted: tuple[float, ...], within: float = 1e-6) -> bool:
    """Return whether two places are the same; an angle may be a whole turn off."""
    if not isinstance(got, tuple | list) or len(got) != 3:
        return False
    apart = [got[0] - wanted[0], got[1] - wanted[1], math.remainder(got[2] - wanted[2], math.tau)]
    return all(abs(value) <= within for value in apart)
