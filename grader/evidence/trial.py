"""Facts about trials: the stimuli, and how the node and the robot answered them."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

from grader.evidence.reasons import Reason

ZERO = 1e-6
"""Of a speed, in m/s and rad/s: a command below is a zero."""


@dataclass(frozen=True)
class Command:
    """One `cmd_vel` message: linear x in m/s, angular z in rad/s, and the largest other component."""

    t: float
    v: float
    omega: float
    other: float = 0.0

    @property
    def is_zero(self) -> bool:
        """Return whether it is zero in every component, to 1e-6 m/s and rad/s. NaN is not."""
        return all(abs(value) <= ZERO for value in (self.v, self.omega, self.other))


@dataclass(frozen=True)
class Sample:
    """The robot's true state and its odometry after one tick: poses in the odom frame (m, rad), speeds (m/s, rad/s).

    `clearance` is from the robot's hull to what is nearest, in m.
    """

    t: float
    x: float
    y: float
    yaw: float
    v: float
    omega: float
    odom_x: float
    odom_y: float
    odom_yaw: float
    clearance: float


@dataclass(frozen=True)
class ScanSummary:
    """A scan's closest valid readings in m: ahead, behind (as wide as the contract says), anywhere; inf if none."""

    t: float
    ahead: float
    behind: float
    anywhere: float


@dataclass(frozen=True)
class Touch:
    """A contact of the hull with an obstacle at `t` s, at `speed` m/s."""

    t: float
    obstacle: str
    speed: float


@dataclass(frozen=True)
class Call:
    """One service call, asked at `t`. Without an answer `response` is None, and `problem` is why none came."""

    t: float
    service: str
    request: dict[str, Any]
    response: dict[str, Any] | None
    problem: Reason | None = None


@dataclass(frozen=True)
class Goal:
    """One goal of the action. `status` is "succeeded", "canceled", "aborted", "rejected" or "unfinished"."""

    t: float
    x: float
    y: float
    tolerance: float
    accepted: bool
    status: str
    success: bool | None
    final_x: float
    final_y: float
    ended_t: float
    cancel_t: float = math.nan
    cancel_accepted: bool | None = None
    feedback: list[list[float]] = field(default_factory=list)
    problem: Reason | None = None


@dataclass(frozen=True)
class Endpoint:
    """One publisher or subscription on the graph. `reliability` is "reliable" or "best_effort"."""

    topic: str
    kind: str
    node: str
    type: str
    reliability: str


@dataclass(frozen=True)
class Graph:
    """One node on the running graph, with all nodes' names. Names have no leading slash."""

    nodes: list[str] = field(default_factory=list)
    endpoints: list[Endpoint] = field(default_factory=list)
    services: dict[str, list[str]] = field(default_factory=dict)
    actions: dict[str, list[str]] = field(default_factory=dict)


@dataclass(frozen=True)
class ProcessEnd:
    """How a node's process ended. `by` is "itself", "us" (stopped after the trial) or "interrupt" (SIGINT)."""

    by: str
    exit_code: int | None
    wall_seconds: float
    output_tail: str


@dataclass(frozen=True)
class Message:
    """One message of a topic that the trial recorded, its fields flattened to plain values."""

    t: float
    topic: str
    data: dict[str, Any]


@dataclass(frozen=True)
class ParameterAnswer:
    """A parameter that was read or set on the running node.

    `accepted` says whether the node took the value `wanted`; it is None if nothing was to be set or no answer came.
    `value` is the parameter's value afterwards, as the node reports it.
    """

    t: float
    name: str
    wanted: Any = None
    accepted: bool | None = None
    value: Any = None
    reason: str = ""
    node: str = ""


@dataclass(frozen=True)
class Ran:
    """The package's Python files of which code ran in a node's process, as the process itself noted.

    `functions` maps the path of each file, as `SourceFile.path` has it, to the first lines of functions of it that ran,
    not always of all; the list is empty where the file was only imported. `unseen` says what code ran that lies in no
    file that can be read: text made into code at run time, byte code, archives, libraries; each as "kind: where, made
    by".
    `of_functions` is False in a trial that notes the latter alone, or whose node has noted nothing.
    """

    functions: dict[str, list[int]] = field(default_factory=dict)
    unseen: list[str] = field(default_factory=list)
    of_functions: bool = True


@dataclass(frozen=True)
class Trial:
    """One run of one node in a world. `pace` is "lockstep" or "real time"; `ended` is None for a complete script.

    Times (`marks`, and the `t` of what is listed) are simulated seconds since the trial began. There is one of the
    `samples` for each tick of 0.05 s.
    """

    name: str
    node: str
    world: str
    seed: int
    ready: bool
    pace: str
    ended: Reason | None
    script_error: str = ""
    choices: dict[str, float] = field(default_factory=dict)
    """What the script has chosen, by the seed or for good."""
    measured: dict[str, float] = field(default_factory=dict)
    """What the script has measured: wall seconds, counts."""
    in_files: dict[str, float] = field(default_factory=dict)
    """The parameters that were changed in the package's own files, with their values there."""
    thresholds: dict[str, float] = field(default_factory=dict)
    """The node's distances that plots have a line for, in m, by their names there."""
    marks: dict[str, float] = field(default_factory=dict)
    commands: list[Command] = field(default_factory=list)
    samples: list[Sample] = field(default_factory=list)
    scans: list[ScanSummary] = field(default_factory=list)
    touches: list[Touch] = field(default_factory=list)
    calls: list[Call] = field(default_factory=list)
    goals: list[Goal] = field(default_factory=list)
    messages: list[Message] = field(default_factory=list)
    published: list[Message] = field(default_factory=list)
    """The simulated sensors' messages, for trials about what a node makes of them."""
    parameters: list[ParameterAnswer] = field(default_factory=list)
    scene: dict[str, Any] = field(default_factory=dict)
    """The world with everything that the script added, in the schema of the world files."""
    graph: Graph | None = None
    other_graph: Graph | None = None
    """The graph of a second node that the script looked at."""
    launch: str = ""
    """The launch file that was run, "" if the node was started directly."""
    process: ProcessEnd | None = None
    wall_seconds: float = 0.0
    others: dict[str, ProcessEnd] = field(default_factory=dict)
    """Other processes of the submission that ran beside the node, by name."""
    foreign: list[str] = field(default_factory=list)
    """Publishers of topics that only the simulator should publish, such as /clock: "topic by node"."""
    dropped: int = 0
    """How many messages were not kept because there were too many."""
    deaf_to: list[str] = field(default_factory=list)
    """The sensors' topics of which the node receives nothing: they are best effort, and it asks for reliable ones."""
    ran: Ran | None = None
    """What ran of the package; None in a trial that does not note it, or whose node did not come up."""
    stopped: str = ""
    """The sandbox's limit that the node exceeded: "memory", "processes" or ""."""
    behind_s: float = 0.0
    """How many wall seconds longer than a robot would have taken the node's own callbacks have waited."""
