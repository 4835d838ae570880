"""Judge the unseen tasks at the ends of three notebooks: another lidar, another base, another service."""

from __future__ import annotations

import math
from collections.abc import Callable
from copy import deepcopy
from dataclasses import dataclass
from functools import partial
from typing import Any

from nav_msgs.msg import Odometry
from rclpy.impl.logging_severity import LoggingSeverity
from sensor_msgs.msg import LaserScan
from std_srvs.srv import SetBool

from grader import notebook
from grader.notebook.bench import Bench, mine
from grader.notebook.feedback import Checked
from grader.notebook.tables import Findings, answered, shown
from grader.words import mark, say

from .lessons import Handle


def check(*asked: Any) -> Checked:
    """Try the learner's function of a task, ("U1", around), on cases that the notebook does not show.

    What is not such a task ("F4") is checked as `grader.notebook.check` does.
    """
    if not asked or asked[0] not in _TASKS:
        return notebook.check(*asked)
    task, *written = asked
    return answered(task, _TASKS[task](*written), say("call it in a cell of your own, and read the whole traceback"))


# Sensing. Angles in degrees: the first beam's, the step to the next, and that of the lidar on the robot.
_LIDARS = ((-119.5, 1, 90), (-119.5, 1, 0), (-119.5, 1, 180), (119.5, -1, 35))
_BEAMS, _RANGE_MIN, _RANGE_MAX = 240, 0.25, 6.0
_INVALID = 0.1875, 7.0  # by this lidar's limits; those of the course's robot are 0.15 and 12 m
_SECTORS = {"ahead": 0.0, "behind": 180.0}


def _around(around: Callable[..., Any]) -> Findings:
    for first, step, mounted in _LIDARS:
        looks = [first + beam * step + mounted for beam in range(_BEAMS)]
        unseen = [name for name, way in _SECTORS.items() if not any(_in_sector(a, way) for a in looks)]
        for post in range(-176, 180, 8):
            scan = LaserScan(angle_min=math.radians(first), angle_increment=math.radians(step))
            scan.range_min, scan.range_max = _RANGE_MIN, _RANGE_MAX
            scan.ranges = [1.5 if abs(math.remainder(angle - post, 360.0)) <= 2 else math.inf for angle in looks]
            scan.ranges[post % _BEAMS], scan.ranges[-post % _BEAMS] = _INVALID
            valid = [angle for angle, reading in zip(looks, scan.ranges, strict=True) if reading == 1.5]
            before = deepcopy(scan)
            got = around(scan, math.radians(mounted))
            if scan != before:
                changed = say("you have changed the scan that came in")
                yield changed, say("a scan that stays as it was"), say("other callbacks may read the same message")
            wanted = {"anywhere": 1.5 if valid else math.inf}
            for name, way in _SECTORS.items():
                reads = 1.5 if any(_in_sector(angle, way) for angle in valid) else math.inf
                wanted[name] = 0.0 if name in unseen else reads
            for name, right in wanted.items():
                found = getattr(got, name, None)
                if not isinstance(found, float | int) or not math.isclose(found, right, abs_tol=1e-3):
                    said = mark("lidar turned by {mounted}°, a post 1.5 m away at {post}° from straight ahead: {got}")
                    seen = say(said, mounted=mounted, post=post, got=f"`{name}` = {shown(found)}")
                    yield seen, shown(right), _advice(name in unseen, found)


def _advice(unseen: bool, found: object) -> str:
    if unseen:
        return say("no beam of this lidar looks there: what may the robot believe about that side?")
    if found in _INVALID:
        return say("which readings are valid is said in the scan, and differs from lidar to lidar")
    return say("from whose x axis is a beam's angle measured, from whose the sector? Draw both for this post")


def _in_sector(angle: float, way: float) -> bool:
    return abs(math.remainder(angle - way, 360.0)) <= 60.0


@dataclass(frozen=True)
class Base:
    """What a maker says of a base, in SI units; `delay` is the longest time from a measurement until it brakes."""

    radius: float
    brake: float
    delay: float
    max_speed: float


_BASES = (Base(0.171, 5.0, 0.4, 0.5), Base(0.35, 0.6, 0.5, 1.2), Base(0.25, 2.0, 0.0, 3.0), Base(0.1, 0.3, 1.0, 0.3))
_SLOWEST = 0.98  # of the highest safe speed


def _safe_speed(safe_speed: Callable[..., Any]) -> Findings:
    for base in _BASES:
        for distance in (0.0, base.radius, base.radius + 0.02, 0.4, 0.55, 0.9, 1.4, 2.5, 6.0, math.inf, math.nan):
            v = safe_speed(distance, base)
            asked = say("{base}, reading {distance} m: you allow {v} m/s", base=base, distance=distance, v=shown(v))
            most = base.max_speed if distance > base.radius else 0.0
            if not isinstance(v, float | int) or not 0.0 <= v <= most:
                expected = say("at most {most} m/s, and not below 0", most=shown(most))
                yield asked, expected, say("what does your formula give at its edges: no room, inf, nan?")
                return
            rolls, room = _rolls(v, base), distance - base.radius
            seen = say("{asked}. It rolls {rolls} m", asked=asked, rolls=shown(rolls))
            if v and rolls > room + 1e-6:
                look = say("put your speed into the formula of the stop distance, with this base's own numbers")
                yield seen, say("less than {room} m: then the hull touches", room=shown(room)), look
            elif v < _SLOWEST * most and _rolls(v / _SLOWEST, base) < room:
                look = say("at which speed is the stop distance just the room that there is?")
                yield seen, say("a base that drives as fast as it safely can"), look


def _rolls(v: float, base: Base) -> float:
    """Return the metres that a base rolls after it has measured, at v m/s."""
    return v * base.delay + v**2 / (2 * base.brake)


def _pausable(pausable: Callable[..., Any]) -> Findings:
    node = Bench(pausable(mine("navigator").Navigator), {})
    node.get_logger().set_level(LoggingSeverity.FATAL)  # what it logs is not the answer
    try:
        yield from _paused(node)
    finally:
        node.get_logger().set_level(LoggingSeverity.UNSET)
        node.close()


def _paused(node: Bench) -> Findings:
    if not any(s.service_name == "/pause" and s.srv_type is SetBool for s in node.services):
        yield say("the node offers no such service"), "`pause`, std_srvs/srv/SetBool", "`create_service`"
        return
    node.ask("set_speed", speed=0.25)
    _drive(node)
    yield from _answer(node, True, say("a pause that begins"))
    yield from _stands(node)
    yield from _answer(node, True, say("a second pause"), success=False)
    node.ask("set_speed", speed=-0.125)
    yield from _stands(node)
    yield from _answer(node, False, say("the end of the pause"))
    if not (after := _drive(node)) or after[-1] != (-0.125, 0.0):
        look = say("keep apart what is wanted and what is allowed now: which did you change?")
        yield _commands(after), say("-0.125 m/s, which was set during the pause"), look
    yield from _answer(node, False, say("a second end"), success=False)
    handle = Handle(3.0, 0.0)
    node.begin(node._navigate, handle)
    _drive(node)
    yield from _answer(node, True, say("a pause on the way to a goal"))
    yield from _stands(node)
    if handle.said:
        yield f"`{handle.said[0]}`", say("a goal that waits"), say("who ended the goal? A pause is not a cancel")
    yield from _answer(node, False, say("the end of that pause"))
    if not (after := _drive(node)) or not after[-1][0] > 0.1:
        look = say("what is wanted while there is a goal?")
        yield _commands(after), say("a robot on its way to the goal again"), look


def _answer(node: Bench, pause: bool, what: str, success: bool = True) -> Findings:
    answer = node.begin(partial(node.ask, "pause", data=pause)).result()
    if (answer.success, bool(answer.message)) != (success, True):
        seen = f"{what}: success = {answer.success}, message = {answer.message!r}"
        yield seen, say("success = {success}, and words", success=success), say("does this request change anything?")


def _stands(node: Bench) -> Findings:
    if set(commands := _drive(node)) != {(0.0, 0.0)}:
        look = say("a base keeps the last command that it heard: who sends the zeros, ten times a second?")
        yield _commands(commands), say("nothing but zeros during the pause"), look


def _commands(commands: list[tuple[float, float]]) -> str:
    if not commands:
        return say("no command at all for a second")
    v, omega = (shown(value + 0.0) for value in commands[-1])  # not -0
    return say("the last command is {v} m/s, {omega} rad/s", v=v, omega=omega)


def _drive(node: Bench) -> list[tuple[float, float]]:
    """Let a second pass, with odometry at (0, 0) and a lidar that sees nothing; return the commands."""
    odom, commands = Odometry(), []
    odom.pose.pose.orientation.w = 1.0
    for _ in range(4):
        commands += node.hear("odom", odom) + node.hear("scan", LaserScan(ranges=[math.inf]))
        commands += node.advance(0.25)
    return commands


_TASKS: dict[str, Callable[..., Findings]] = {"U1": _around, "U2": _safe_speed, "U3": _pausable}
