"""A found case of the controller as a test of the package itself, on the bench of notebook 09."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterator
from typing import Any

from grader.trials.case import READINGS
from grader.trials.promises import Broken, Promise, Run

NODE = "robot_controller"
_STOPPED = "assert robot.commands[-1].linear.x == 0.0"
_ZERO = f"{_STOPPED}\nassert robot.commands[-1].angular.z == 0.0"
_DRIVES = "assert abs(robot.commands[-1].linear.x - {wanted:g}) < 0.02"
_ENDED = "assert robot.goal.result.done()\n_, success, final = robot.outcome(robot.goal)\n"
_ARRIVED = f"""{_ENDED}assert success
assert math.dist((robot.x, robot.y), robot.target) < {{tolerance:g}} + 0.05
assert math.dist(final, (robot.x, robot.y)) < 0.05"""
_TURNED = """turn = answer.pose.orientation
assert math.cos(2 * math.atan2(turn.z, turn.w) - robot.yaw) > 0.98"""
_REMAINING = """remaining = math.dist((robot.x, robot.y), robot.target)
assert abs(robot.feedback[-1].distance_remaining - remaining) < 0.1"""
_WHOLE = ("arrives_where_it_says", "arrives_in_the_end")
"""Promises about how a goal ends, for which the case is done to its end."""
_HOLDS = (
    ("never_touches stops_in_time sees_what_is_real_among_bad_readings", "touch late", _STOPPED),
    ("stands_in_an_emergency stands_without_a_command cancels", "late v c", _ZERO),
    ("drives_at_the_set_speed drives_on takes_no_bad_reading_for_an_obstacle", "wanted", _DRIVES),
    ("refuses_what_is_too_fast", "taken", "assert answer.success is {right}"),
    ("status_is_true", "flag", "assert answer.obstacle_detected is {right}"),
    ("status_is_true", "wanted", "assert abs(answer.speed - {wanted:g}) < 0.01"),
    ("status_is_true", "turned", _TURNED),
    ("arrives_where_it_says arrives_in_the_end", "off a", _ARRIVED),
    ("does_not_give_up", "", "robot.drive(0.2)\nassert not robot.goal.result.done()"),
    ("feedback_is_true", "w", _REMAINING),
    ("feedback_is_true", "gap", "before = len(robot.feedback)\nrobot.drive(0.8)\nassert len(robot.feedback) > before"),
    ("cancels", "goal", f"robot.drive(1.0)\n{_ENDED}assert not success"),
)
"""What holds at the moment of a break, after the promises and the values of `Broken.fields` that it is for."""

_TEST = '''"""
{about}
"""

from array import array
import cmath
import math

from ros2_robot_controller.robot_controller import RobotController
from sensor_msgs.msg import LaserScan
from test_robot_controller import Robot


class Found(Robot):
    """A robot among round things. Its lidar has 360 beams, and scans ten times a second."""

    def __init__(self, bench, published, degrees):
        super().__init__(bench, published)
        self.yaw, self.ticks, self.hears = math.radians(degrees), 0, True
        self.things, self.change, self.limits = {{}}, list, (0.15, 12.0)

    def place(self, bearing, distance):
        """Return a place as a complex number, x + y * 1j."""
        return complex(self.x, self.y) + cmath.rect(distance, self.yaw + math.radians(bearing))

    def put(self, name, bearing, distance, radius, speed=0.0, towards=0.0):
        """Put something round there, its surface `distance` away; it may move."""
        velocity = cmath.rect(speed, self.yaw + math.radians(towards))
        self.things[name] = [self.place(bearing, distance + radius), radius, velocity]

    def go(self, bearing, distance, tolerance):
        """Send a goal that lies there."""
        there = self.place(bearing, distance)
        self.target = (there.real, there.imag)
        self.goal = self.send(*self.target, tolerance)

    def sense(self):
        """Let a tick of 0.05 s pass."""
        for thing in self.things.values():
            thing[0] += 0.05 * thing[2]
        self.ticks += 1
        self.scan = None
        if self.hears and self.ticks % 2 == 0:
            ranges = self.change([self.measure(beam - 180) for beam in range(360)])
            least, most = array('f', self.limits)  # as they come in a message, to the last bit
            self.scan = LaserScan(
                ranges=ranges, angle_min=-math.pi, angle_increment=math.tau / 360,
                range_min=least, range_max=most)
        super().sense()

    def measure(self, degrees):
        """Return how far the nearest thing is in a direction."""
        found, here = math.inf, self.place(degrees, 0.0)
        for place, radius, _ in self.things.values():
            away = (place - here) / (self.place(degrees, 1.0) - here)
            if away.real > 0.0 and abs(away.imag) <= radius:
                found = min(found, away.real - math.sqrt(radius**2 - away.imag**2))
        return found if found >= 0.15 else -math.inf


def test_{name}(make_bench, published):
{body}
'''


def as_test(run: Run, promise: Promise, broken: Broken, done: str) -> str:
    """Return a test that does the case up to the break and asserts what should hold then, "" if that cannot be."""
    about = [(values.split(), text) for names, values, text in _HOLDS if promise.name in names.split()]
    holds = [text for values, text in about if not values or {*values} & {*broken.fields}]
    whole = promise.name in _WHOLE
    if not holds or (whole and any(step.do == "cancel" for step in run.case.steps)):
        return ""
    tolerance = [step.to["tolerance"] for step in run.case.steps if step.do == "goal"][-1:]
    right = not broken.fields.get("flag", broken.fields.get("taken"))
    lines = [*_steps(run, math.inf if whole else broken.t)]
    if "answer." in holds[0]:
        lines[-1] = f"answer = {lines[-1]}"
    lines += textwrap.wrap(promise.sentence, 90, initial_indent="# ", subsequent_indent="# ")
    lines += holds[0].format(**broken.fields, tolerance=(*tolerance, 0.0)[0], right=right).splitlines()
    body = [f"robot = Found(make_bench(RobotController), published, {run.case.heading:g})", *lines]
    return _TEST.format(
        about=textwrap.fill(f"Found by a hunt: {done}.", 98, break_on_hyphens=False),
        name=promise.name,
        body=textwrap.indent("\n".join(body), "    "),
    )


def _steps(run: Run, until: float) -> Iterator[str]:
    """Yield the lines of a test that do a case's steps, up to a time."""
    steps, marks = run.case.steps, run.trial.marks
    limits = (0.15, 12.0)
    for number, step in enumerate(steps):
        began = marks.get(f"{number} {step.do}", math.inf)
        if began > until + 1e-9:
            return
        ended = marks.get(f"{number + 1} {steps[number + 1].do}", run.end) if step is not steps[-1] else run.end
        limits = (step.to["least"], step.to["most"]) if step.do == "limits" else limits
        if step.do == "arrive" and ended <= until:
            yield "robot.finish(robot.goal)"
        elif step.do in ("wait", "arrive"):
            seconds = round(min(ended, until) - began, 2)
            yield from [f"robot.drive({seconds:g})"] if seconds else []
        else:
            yield from _line(step.do, step.to, limits)


def _line(do: str, to: Any, limits: tuple[float, float]) -> Iterator[str]:
    given = ", ".join(f"{name}={value!r}" for name, value in to.items()) if isinstance(to, dict) else ""
    match do:
        case "call":
            yield f"robot.set_speed({_number(to['speed'])})" if "speed" in to else "robot.status()"
        case "goal" | "obstacle":
            yield f"robot.{'go' if do == 'goal' else 'put'}({given})"
        case "cancel":
            yield "robot.bench.until(robot.goal.handle.cancel_goal_async())"
        case "remove":
            yield f"robot.things.pop({to!r})"
        case "limits":
            yield f"robot.limits = {limits!r}"
        case "silence" | "hear" if to == "scan":
            yield f"robot.hears = {do == 'hear'}"
        case "set":
            yield from (f"robot.bench.set_parameter({name!r}, {value!r})" for name, value in to.items())
        case "readings":
            reads, every = READINGS[to["kind"]], to.get("every", 1)
            some = f" if n % {every} == 0 else r" if every > 1 else ""
            change = f"[{_number(reads(*limits))}{some} for n, r in enumerate(ranges)]" if reads else "[]"
            yield f"robot.change = {'list' if to['kind'] == 'true' else f'lambda ranges: {change}'}"


def _number(value: float) -> str:
    """Return a number as Python reads it."""
    return repr(round(float(value), 4)) if math.isfinite(value) else f"math.{value}".replace("math.-", "-math.")
