"""A case: a short trial as data that a person can read and edit. Hunts make them up; people keep and hand them in."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import yaml
from yaml.constructor import SafeConstructor

from grader import yaml_reader
from grader.course import Course, definition
from grader.errors import GraderError
from grader.trials.plan import TrialPlan
from grader.yaml_reader import YamlReader
from sim import sensors
from sim.robot import COURSE as ROBOT

if TYPE_CHECKING:
    from grader.trials.stage import Stage

WORLD = "open_field"
_HEAD = ("node", "steps")
_OPTIONAL = ("parameters", "heading", "seed", "breaks", "seen")
_SENSORS = {"scan": sensors.ScanReading, "imu": sensors.ImuReading, "battery": sensors.BatteryReading}
READINGS: Mapping[str, Callable[[float, float], float] | None] = {
    "nan": lambda _least, _most: math.nan,
    "inf": lambda _least, _most: math.inf,
    "zero": lambda _least, _most: 0.0,
    "too near": lambda least, _most: 0.85 * least,
    "least": lambda least, _most: least,
    "most": lambda _least, most: most,
    "too far": lambda _least, most: 1.1 * most,
    "none": None,
    "true": None,
}
"""What beams may be made to read, in m, given range_min and range_max.

"least" and "most" are valid, "none" is a scan without readings, "true" puts an end to it.
"""


@dataclass(frozen=True)
class Step:
    """One thing that is done: the name of it, and with what."""

    do: str
    to: Any


@dataclass(frozen=True, eq=False)
class Case:
    """What is done to a node and its robot, step by step.

    Attributes:
        node: the node under test.
        steps: what is done, in order.
        parameters: overrides of the node's parameters.
        heading: of the robot at the start, in degrees from the x axis of the odom frame.
        seed: of the sensors' noise.
    """

    node: str
    steps: tuple[Step, ...]
    parameters: Mapping[str, Any] = field(default_factory=dict)
    heading: float = 0.0
    seed: int = 0

    def plain(self) -> dict[str, Any]:
        """Return it as YAML and JSON can hold it; `of` reads it again."""
        found: dict[str, Any] = {"node": self.node, "steps": [{step.do: step.to} for step in self.steps]}
        found |= {"parameters": dict(self.parameters)} if self.parameters else {}
        found |= {name: value for name in ("heading", "seed") if (value := getattr(self, name))}
        return found

    @classmethod
    def of(cls, plain: Mapping[str, Any]) -> Case:
        """Return the case of which `plain` has returned this."""
        steps = tuple(Step(*next(iter(step.items()))) for step in plain["steps"])
        return cls(**{**plain, "steps": steps})

    def __eq__(self, other: object) -> bool:
        """Return whether the other has the same text: two NaN are not equal, and the cases that have them are."""
        return isinstance(other, Case) and self.text == other.text

    def __hash__(self) -> int:
        return hash(self.text)

    @cached_property
    def text(self) -> str:
        """Return it as YAML, a line for each step."""
        text: str = yaml.dump(
            self.plain(), Dumper=_Dumper, default_flow_style=None, sort_keys=False, width=100, allow_unicode=True
        )
        return text

    def plan(self, name: str) -> TrialPlan:
        """Return the trial that does the steps."""
        return TrialPlan(name, "", self.script, self.node, WORLD, parameters=self.parameters, case=self.plain())

    def script(self, stage: Stage) -> None:
        """Do the steps. Of each, the mark "NUMBER NAME" has the time."""
        so_far = _SoFar()
        for number, step in enumerate(self.steps):
            stage.mark(f"{number} {step.do}")
            STEPS[step.do](stage, step.to, so_far)


class _Dumper(yaml.SafeDumper):
    """Writes the same step out each time that it is done."""

    def ignore_aliases(self, _data: Any) -> bool:
        return True


@dataclass
class _SoFar:
    """What later steps of a case need of earlier ones: its goals, and the limits that the scans state."""

    goals: list[Any] = field(default_factory=list)
    limits: tuple[float, float] = (ROBOT.lidar.range_min, ROBOT.lidar.beams.range_max)


def _call(stage: Stage, to: Mapping[str, Any], _so_far: _SoFar) -> None:
    stage.call(to["service"], **{name: value for name, value in to.items() if name != "service"})


def _goal(stage: Stage, to: Mapping[str, Any], so_far: _SoFar) -> None:
    pose = stage.simulator.odometry().pose
    angle = pose.yaw + math.radians(to["bearing"])
    x, y = pose.x + to["distance"] * math.cos(angle), pose.y + to["distance"] * math.sin(angle)
    so_far.goals.append(stage.navigate(x, y, to["tolerance"]))


def _cancel(_stage: Stage, _to: object, so_far: _SoFar) -> None:
    if so_far.goals and so_far.goals[-1].running:
        so_far.goals[-1].cancel()


def _obstacle(stage: Stage, to: Mapping[str, Any], _so_far: _SoFar) -> None:
    stage.add_obstacle(
        to["distance"], math.radians(to["bearing"]), to["radius"], name=str(to["name"]),
        towards=math.radians(to.get("towards", 0.0)), speed=to.get("speed", 0.0),
    )  # fmt: skip


def _remove(stage: Stage, to: object, _so_far: _SoFar) -> None:
    if any(obstacle.name == str(to) for obstacle, _ in stage.simulator.obstacles):
        stage.remove_obstacle(str(to))


def _limits(stage: Stage, to: Mapping[str, float], so_far: _SoFar) -> None:
    so_far.limits = (float(to["least"]), float(to["most"]))
    stage.set_range_limits(*so_far.limits)


def _readings(stage: Stage, to: Mapping[str, Any], so_far: _SoFar) -> None:
    kind, every = to["kind"], int(to.get("every", 1))
    made = READINGS[kind]
    value = made(*so_far.limits) if made else None

    def change(ranges: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
        return ranges[:0] if value is None else np.where(np.arange(len(ranges)) % every == 0, value, ranges)

    stage.distort(None if kind == "true" else change)


def _set(stage: Stage, to: Mapping[str, Any], _so_far: _SoFar) -> None:
    for name, value in to.items():
        stage.set_parameter(name, value)


STEPS: Mapping[str, Callable[[Stage, Any, _SoFar], object]] = {
    "wait": lambda stage, to, _: stage.run(to),
    "call": _call,
    "goal": _goal,
    "cancel": _cancel,
    "arrive": lambda stage, to, so_far: stage.run_until(
        lambda: all(goal.ended or goal.problem for goal in so_far.goals), to
    ),
    "obstacle": _obstacle,
    "remove": _remove,
    "limits": _limits,
    "readings": _readings,
    "silence": lambda stage, to, _: stage.mute(_SENSORS[to]),
    "hear": lambda stage, to, _: stage.unmute(_SENSORS[to]),
    "set": _set,
    "listen": lambda stage, to, _: stage.listen(to),
    "battery": lambda stage, to, _: stage.simulator.set_battery(to / 100),
    "interrupt": lambda stage, to, _: stage.interrupt(to),
}
"""What a step may do. Distances in m, bearings in degrees to the left of the robot's heading, times in simulated s."""

_NEEDED: Mapping[str, tuple[str, ...]] = {
    "goal": ("bearing", "distance", "tolerance"),
    "obstacle": ("name", "bearing", "distance", "radius"),
    "limits": ("least", "most"),
    "readings": ("kind",),
}
_MAY: Mapping[str, tuple[str, ...]] = {"obstacle": ("speed", "towards"), "readings": ("every",)}
_NUMBERS = ("wait", "arrive", "battery", "interrupt")
_LEAST: Mapping[str, float] = {
    "wait": 0.05, "arrive": 0.05, "interrupt": 0.05, "battery": 0, "distance": 0, "radius": 0.001, "every": 1,
}  # fmt: skip
_MOST, _DIGITS = 1e9, 30
_INT, _FLOAT = "tag:yaml.org,2002:int", "tag:yaml.org,2002:float"
_TYPES = {"bool": "tag:yaml.org,2002:bool", "string": "tag:yaml.org,2002:str", "float32": _FLOAT, "float64": _FLOAT}


def read(path: Path, course: Course) -> Case:
    """Return the case in a file.

    Raises:
        GraderError: it cannot be read, or something in it is not as it should be; file and line are named.
    """
    return of_text(path, yaml_reader.text(path), course)


def of_text(path: Path, text: str, course: Course) -> Case:
    """Return the case in the text of a file.

    Raises:
        GraderError: something in it is not as it should be; file and line are named.
    """
    root = yaml_reader.compose(path, text)
    _Reading(YamlReader(), course).check(root)
    try:
        plain = SafeConstructor().construct_document(root)
        json.dumps(plain)  # which has no dates, as YAML has
    except (yaml.YAMLError, ValueError, TypeError) as error:
        raise GraderError(f"{path} cannot be read ({error}).") from error
    return Case.of(
        {name: value for name, value in plain.items() if name not in ("breaks", "seen") and value is not None}
    )


class _Reading:
    """Reads one file: what a step may be about is what the contract of the case's node has."""

    def __init__(self, reader: YamlReader, course: Course) -> None:
        self._reader, self._course = reader, course
        self._obstacles: list[str] = []

    def check(self, root: yaml.Node) -> None:
        reader = self._reader
        found = reader.fields(root, root, _HEAD, "a case", _OPTIONAL)
        name = reader.one_of(found["node"], tuple(self._course.nodes), "a node of the contract")
        self._contract = self._course.nodes[name]
        for name in [name for name in ("heading", "seed") if name in found]:
            self._number(found[name], whole=name == "seed")
        if "parameters" in found:
            self._parameters(found["parameters"])
        reader.every(found["steps"], self._step)

    def _step(self, item: yaml.Node) -> None:
        reader = self._reader
        steps = list(reader.mapping(item, tuple(STEPS)))
        if len(steps) != 1:
            reader.fail(item, "a step has one name, such as `- wait: 1.0`")
        name, key, to = steps[0]
        if name in _NEEDED:
            self._fields(name, reader.fields(to, key, _NEEDED[name], f"the step {name}", _MAY.get(name, ())), key)
        elif name in _NUMBERS:
            self._number(to, name)
        elif name == "call":
            self._call({field: node for field, _, node in reader.mapping(to)}, key)
        elif name == "set":
            self._parameters(to)
        elif name == "remove":
            reader.one_of(to, self._obstacles, "an obstacle of a step above")
        elif name in ("silence", "hear"):
            reader.one_of(to, tuple(_SENSORS), "a sensor")
        elif name == "listen":
            reader.one_of(to, (*self._contract.publishes, "rosout"), "a topic of this node")

    def _fields(self, step: str, fields: dict[str, yaml.Node], key: yaml.Node) -> None:
        reader = self._reader
        if step == "goal" and not self._contract.actions:
            reader.fail(key, f"{self._contract.name} has no action, so it takes no goals")
        if step == "readings":
            reader.one_of(fields.pop("kind"), tuple(READINGS), "a kind of reading")
        if step == "obstacle":
            name = reader.text(node := fields.pop("name"))
            if name in self._obstacles:
                reader.fail(node, f"{name} is the name of an obstacle above; each needs its own")
            self._obstacles.append(name)
        for name, node in fields.items():
            self._number(node, name, whole=name == "every")

    def _call(self, fields: dict[str, yaml.Node], key: yaml.Node) -> None:
        reader = self._reader
        if "service" not in fields:
            reader.fail(key, "'service' is missing; a call needs service")
        type_ = self._contract.services[
            reader.one_of(fields.pop("service"), tuple(self._contract.services), "a service of this node")
        ]
        if type_ not in self._course.interfaces:
            return
        text = (self._course.contract / self._course.interface_file(type_)).read_text(encoding="utf-8")
        request = definition.parts(text)[0]
        for name, node in fields.items():
            reader.require_known(name, node, request, f"a field of {type_}")
            self._typed(node, _TYPES.get(request[name], _INT if "int" in request[name] else ""))

    def _parameters(self, to: yaml.Node) -> None:
        known = self._contract.parameters
        for name, key, node in self._reader.mapping(to):
            self._reader.require_known(name, key, known, "a parameter of this node")
            self._typed(node, _TYPES["string"] if isinstance(known[name].default, str) else _FLOAT)

    def _typed(self, node: yaml.Node, tag: str) -> None:
        """Check that a value is of the type that ROS needs, which converts none."""
        text = self._reader.text(node)
        if tag == _FLOAT and node.tag == _INT:
            self._reader.fail(node, f"a float is needed here: write {text}.0")
        if tag and node.tag != tag:
            self._reader.fail(node, f"a value of the type {tag.rpartition(':')[2]} is needed here, not {text}")

    def _number(self, node: yaml.Node, name: str = "", *, whole: bool = False) -> None:
        if node.tag not in ((_INT,) if whole else (_INT, _FLOAT)):
            self._reader.fail(node, f"a {'whole number' if whole else 'number such as 0.5'} is expected here")
        text = self._reader.text(node)
        value = SafeConstructor().construct_document(node) if len(text) < _DIGITS else math.inf
        if not _LEAST.get(name, -_MOST) <= value <= (100 if name == "battery" else _MOST):
            self._reader.fail(node, f"{text[:_DIGITS]} is out of range here")
