"""What a trial's script can do: let time pass, call, send goals, move the world. Everything it does is recorded."""

from __future__ import annotations

import math
import random
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path, PurePosixPath
from typing import Any, TypeVar

import numpy as np
from action_msgs.msg import GoalStatusArray
from rcl_interfaces.msg import Log
from rclpy.action.client import ActionClient
from rclpy.parameter import Parameter, parameter_value_to_python
from rclpy.parameter_client import AsyncParameterClient
from rclpy.qos import qos_profile_action_status_default
from std_msgs.msg import Float32

from grader import evidence
from grader.sandbox import Process
from grader.trials import graph
from grader.trials.catalog import TrialPlan
from grader.trials.flatten import fill, plain
from grader.trials.goal import GoalRun
from grader.trials.relay import Relay
from grader.trials.types import SERVICES, NavigateToPosition, SensorFusionData
from sim import Circle
from sim.bridge import CONTROLLER, PROCESSOR, TICK_S, Bridge, Topics
from sim.sensors import BatteryReading, ImuReading, Reading, ScanReading
from sim.simulator import Simulator

T = TypeVar("T")

_ANSWER_WITHIN_S = 2.0  # simulated, for a service or a goal's acceptance
_ANSWER_WALL_S = 3.0  # the clock stands still so long for an answer before time goes on
_ENDING_ROUNDS = 8
# Of each kind. An honest trial has a thousand at most; a node that floods its observer must not fill our memory.
_KEPT = 20_000
TOPICS: dict[str, tuple[Any, int]] = {
    "sensor_fusion_data": (SensorFusionData, 10),
    "obstacle_distance": (Float32, 10),
    "rosout": (Log, 100),
}
"""The topics that a script can listen to."""

_ACTION = "navigate_to_position"
SOURCE = Path("/ws/src/ros2_robot_controller")
"""Where a wall shows the package's source."""
_SECTOR = math.radians(60)


class TrialOver(Exception):
    """The script cannot go on; the message says why. What was recorded so far is evidence all the same."""


class Stage:
    """A node, a robot and a world, in the hands of a trial's script. Times are simulated seconds since the start."""

    def __init__(self, plan: TrialPlan, seed: int, simulator: Simulator, process: Process, domain_id: int) -> None:
        self.plan = plan
        self.simulator = simulator
        self.process = process
        # Seeded with a text, so that each trial draws its own numbers from the instructor's one seed.
        self.random = random.Random(f"{seed}:{plan.name}")
        self.bridge = Bridge(
            simulator,
            _topics(plan),
            plan.node,
            domain_id=domain_id,
            alive=lambda: process.exit_code() is None,
            reliable=plan.reliable,
            # Nobody can address the observer who does not know its name.
            own_name=f"observer_{random.SystemRandom().getrandbits(48):012x}",
        )
        self.bridge.on_command = self._take_command
        self.bridge.on_published = self._take_published
        self.start: Callable[[Sequence[str]], Process]
        """Start another command of the submission behind the same wall; the host provides it."""
        self.others: dict[str, Process] = {}
        self._relay: Relay | None = None
        self._domain_id = domain_id
        self.ready = False
        self.interrupted = False
        self.choices: dict[str, float] = {}
        self.marks: dict[str, float] = {}
        self.commands: list[evidence.Command] = []
        self.samples: list[evidence.Sample] = []
        self.scans: list[evidence.ScanSummary] = []
        self.calls: list[evidence.Call] = []
        self.goals: list[GoalRun] = []
        self.messages: list[evidence.Message] = []
        self.published: list[evidence.Message] = []
        self.parameters: list[evidence.ParameterAnswer] = []
        self.graph: evidence.Graph | None = None
        self.other_graph: evidence.Graph | None = None
        self._dropped = 0
        self._odometry = simulator.odometry()
        self._started = time.monotonic()
        self._wall_limit = 120.0
        node = self.bridge.node
        self._clients: dict[str, Any] = {}
        self.action: Any = None
        self._parameter_clients = {name: AsyncParameterClient(node, name) for name in {plan.node, *plan.awaits}}
        if plan.node == "robot_controller":
            names = {name: plan.remappings.get(name, name) for name in SERVICES}
            self._clients = {name: node.create_client(SERVICES[name], names[name]) for name in SERVICES}
            self.action = ActionClient(node, NavigateToPosition, _ACTION)
        else:
            self.bridge.watch_answers(SensorFusionData)

    # -- what scripts use -----------------------------------------------------------------------------------------

    @property
    def t(self) -> float:
        """Return the simulated time since the trial began, in seconds."""
        return self.bridge.time

    def choose(self, name: str, options: Sequence[float]) -> float:
        """Return one of `options`, picked by the seed, and put it on record under `name`."""
        self.choices[name] = self.random.choice(list(options))
        return self.choices[name]

    def between(self, name: str, low: float, high: float) -> float:
        """Return a number from [low, high], picked by the seed, and put it on record under `name`."""
        self.choices[name] = round(self.random.uniform(low, high), 3)
        return self.choices[name]

    def mark(self, name: str) -> None:
        """Put the present time on record under `name`."""
        self.marks[name] = self.t

    def run(self, seconds: float) -> None:
        """Let `seconds` of simulated time pass."""
        for _ in range(max(1, round(seconds / TICK_S))):
            self._tick()

    def run_until(self, condition: Callable[[], bool], limit: float) -> bool:
        """Let time pass until `condition` holds, at most `limit` simulated seconds. Return whether it holds."""
        end = self.t + limit - 1e-9
        while not condition():
            if self.t >= end:
                return False
            self._tick()
        return True

    def call(self, service: str, **fields: object) -> evidence.Call:
        """Call a service of the contract and wait for the answer. No answer is a fact too, not an error."""
        client = self._clients[service]
        asked = self.t
        if not client.service_is_ready():
            return self._note_call(
                asked, service, fields, None, f"there is no service {service} of the contract's type"
            )
        request = fill(SERVICES[service].Request(), dict(fields))
        future = client.call_async(request)
        self._await(future.done)
        if not future.done():
            client.remove_pending_request(future)
            problem = f"no answer within {_ANSWER_WITHIN_S:g} s"
            return self._note_call(asked, service, fields, None, problem)
        response = future.result()
        self.bridge.settle()
        return self._note_call(asked, service, fields, plain(response), "")

    def navigate(self, x: float, y: float, tolerance: float = 0.1) -> GoalRun:
        """Send a goal and wait until it is accepted or rejected. Position in the odom frame, in metres."""
        goal = GoalRun(self, x, y, tolerance)
        self.goals.append(goal)
        if not self.action.server_is_ready():
            goal.problem = f"there is no action {_ACTION} of the contract's type"
            return goal
        self._await(lambda: goal.answered)
        if not goal.answered:
            goal.problem = f"the goal was neither accepted nor rejected within {_ANSWER_WITHIN_S:g} s"
        elif goal.accepted:
            # A navigation loop that sleeps by wall time would fall behind a clock that races ahead.
            self.bridge.await_feedback()
        return goal

    def listen(self, topic: str) -> None:
        """Record every message of a topic (one of TOPICS) from now on."""
        message_type, depth = TOPICS[topic]

        def take(message: Any) -> None:
            if self._has_room(self.messages):
                self.messages.append(evidence.Message(self.t, topic, plain(message)))

        self.bridge.node.create_subscription(message_type, topic, take, depth)

    def mute(self, *kinds: type) -> None:
        """Let these sensors fall silent: ScanReading, OdometryReading, ImuReading, BatteryReading."""
        self.bridge.muted |= set(kinds)

    def unmute(self, *kinds: type) -> None:
        """Let these sensors speak again."""
        self.bridge.muted -= set(kinds)

    def distort(self, change: Callable[[np.ndarray[Any, Any]], np.ndarray[Any, Any]] | None) -> None:
        """Publish scans with their ranges changed from now on; None for the true ones."""
        self.bridge.filter_scan = (lambda scan: scan) if change is None else _Distorted(change)

    def hold(self, wall_seconds: float) -> int:
        """Let the clock stand still and return how often the node answers meanwhile."""
        before = self.bridge.answers
        self.bridge.spin_until(lambda: False, wall_seconds)
        return self.bridge.answers - before

    def ask_parameter(self, name: str, node: str = "") -> evidence.ParameterAnswer:
        """Put the value of a parameter of the node (or of another one) on record."""
        return self._note_parameter(name, None, None, "", node or self.plan.node)

    def look_again(self) -> None:
        """Look at the graph once more, when what has been started has had time to come up."""
        self.hold(1.0)
        self.graph = graph.look(self.bridge.node, self.plan.node)

    def look_at(self, node: str) -> None:
        """Put on record what the graph shows of another node."""
        self.other_graph = graph.look(self.bridge.node, node)

    def set_parameter(self, name: str, value: object) -> evidence.ParameterAnswer:
        """Set a parameter of the running node and put on record what became of it."""
        future = self._parameters_of(self.plan.node).set_parameters([Parameter(name, value=value)])
        self._await(future.done)
        if not future.done() or future.result() is None:
            return self._note_parameter(name, value, None, f"no answer within {_ANSWER_WITHIN_S:g} s", self.plan.node)
        answers = future.result().results
        if not answers:
            return self._note_parameter(name, value, None, "an answer without a result", self.plan.node)
        result = answers[0]
        return self._note_parameter(name, value, bool(result.successful), str(result.reason)[:300], self.plan.node)

    def put_ahead(self, distance: float, bearing: float = 0.0, radius: float = 0.15) -> str:
        """Put a round obstacle at `bearing` (rad), its surface `distance` metres from the lidar. Return its name."""
        pose = self.simulator.pose
        angle, reach = pose.yaw + bearing, distance + radius
        center = (pose.x + reach * math.cos(angle), pose.y + reach * math.sin(angle))
        return self.simulator.add_obstacle(Circle(center=center, radius=radius))

    def take_away(self, name: str) -> None:
        """Take an obstacle away."""
        self.simulator.remove_obstacle(name)

    def relay(self, services: Iterable[str]) -> None:
        """Offer services in the node's place and pass calls on to it, so that those of others are on record too.

        Drives on until those behind have been found, or as long as an answer may take.
        """
        behind = {service: (SERVICES[service], self.plan.remappings[service]) for service in services}

        def note(service: str, request: Any, answer: Any) -> None:
            self._note_call(self.t, service, plain(request), plain(answer), "")

        self._relay = Relay(self._domain_id, behind, note)
        self.run_until(self._relay.is_ready, _ANSWER_WITHIN_S)

    def watch_goals(self) -> None:
        """Put on record what the action's status topic tells of everybody's goals."""
        topic = f"{_ACTION}/_action/status"

        def take(message: Any) -> None:
            for status in message.status_list[:20]:
                goal = bytes(status.goal_info.goal_id.uuid).hex()
                if not self._has_room(self.messages):
                    return
                self.messages.append(evidence.Message(self.t, topic, {"goal": goal, "status": status.status}))

        self.bridge.node.create_subscription(GoalStatusArray, topic, take, qos_profile_action_status_default)

    def play(self, script: str) -> Process:
        """Start a Python script of the package's source, by its path in it."""
        process = self.others[PurePosixPath(script).name] = self.start(["python3", str(SOURCE / script)])
        return process

    def interrupt(self, limit: float = 5.0) -> None:
        """Press Ctrl-C: send SIGINT to the node and wait for its end, `limit` seconds at most.

        The seconds are wall time without that in which other processes had the cores: a busy machine gives more.
        """
        self.mark("interrupt")
        self.interrupted = True
        before, queued = self.process.queued(), 0.0
        started = time.monotonic()
        self.process.interrupt()
        while self.process.exit_code() is None and time.monotonic() - started - queued < limit:
            # The clock goes on: a node that waits for its next message hears of the signal only when that has come.
            self.bridge.tick_by_wall()
            waits = (now - before.get(thread, 0.0) for thread, now in self.process.queued().items())
            queued = max(queued, *waits, 0.0)
        if self.process.exit_code() is not None:
            self.choices["seconds_to_end"] = round(time.monotonic() - started - queued, 2)
        # The node's last words may still be on their way.
        self.bridge.alive = lambda: True
        self.bridge.spin_until(lambda: False, 0.05)

    # -- what the host uses ---------------------------------------------------------------------------------------

    def open(self) -> None:
        """Wait for the node to come up and look at the graph.

        Raises:
            TrialOver: it does not come up.
        """
        # Nodes of one launch file come up one after the other, and on a busy machine seconds apart.
        patience = {"quiet_s": 3.0} if self.plan.launch else {}
        self.ready = self.bridge.await_node(self._all_there, **patience)
        self.graph = graph.look(self.bridge.node, self.plan.node)
        if not self.ready:
            raise TrialOver(self._why_not_ready())
        if self.plan.real_time:
            self.bridge.pace = "real time"
        self._sample()

    def facts(self, ended: str, script_error: str) -> evidence.Trial:
        """Return everything that was recorded."""
        code = self.process.exit_code()
        by = "us" if code is None else "interrupt" if self.interrupted else "itself"
        return evidence.Trial(
            name=self.plan.name,
            node=self.plan.node,
            world=self.plan.world,
            seed=self.simulator.seed,
            ready=self.ready,
            pace=self.bridge.pace,
            ended=ended,
            script_error=script_error,
            choices=self.choices,
            marks=self.marks,
            commands=self.commands,
            samples=self.samples,
            scans=self.scans,
            touches=[
                evidence.Touch(contact.time, contact.obstacle, contact.speed) for contact in self.simulator.contacts
            ],
            calls=self.calls,
            goals=[goal.facts() for goal in self.goals],
            messages=self.messages,
            published=self.published,
            parameters=self.parameters,
            scene=self._scene(),
            graph=self.graph,
            other_graph=self.other_graph,
            launch=self.plan.launch,
            process=evidence.ProcessEnd(by, code, round(self.process.wall_seconds, 2), self.process.output[-4000:]),
            wall_seconds=round(time.monotonic() - self._started, 2),
            others={name: _end(process) for name, process in self.others.items()},
            foreign=graph.foreign_publishers(self.bridge.node, ["/clock", *self._own_topics()]),
            dropped=self._dropped,
            stopped=self.process.stopped(),
        )

    def _has_room(self, kept: list[Any]) -> bool:
        """Return whether one more may be kept; count it if not."""
        full = len(kept) >= _KEPT
        self._dropped += full
        return not full

    def _own_topics(self) -> list[str]:
        """Return the sensors' topics: nobody but the simulator publishes them."""
        topics = self.bridge.topics
        return [f"/{name}" for name in (topics.scan, topics.odom, topics.imu, topics.battery) if name]

    def close(self) -> None:
        """Leave the graph."""
        if self._relay is not None:
            self._relay.close()
        self.bridge.close()

    # -- inside ---------------------------------------------------------------------------------------------------

    def _tick(self) -> None:
        code = self.process.exit_code()
        if code is not None:
            raise TrialOver(f"the node ended at {self.t:.2f} s with exit status {code}")
        if time.monotonic() - self._started > self._wall_limit:
            raise TrialOver(f"the trial took more than {self._wall_limit:g} s of wall time")
        going = any(goal.running for goal in self.goals)
        self.bridge.tick(further_rounds=int(going))
        if going and self.commands and _stands(self.commands[-1]):
            # It may be there: it is some rounds from the timer that stops it to the result.
            self.bridge.settle(_ENDING_ROUNDS)
        self._sample()
        if any(goal.silent for goal in self.goals):
            self.bridge.await_feedback()

    def _await(self, condition: Callable[[], bool]) -> None:
        """Wait with the clock standing still, which keeps the answer's time exact; if that is no use, let time pass."""
        if self.bridge.pace == "lockstep" and self.bridge.spin_until(condition, _ANSWER_WALL_S):
            return
        self.run_until(condition, _ANSWER_WITHIN_S)

    def _note_call(
        self, asked: float, service: str, request: dict[str, object], response: Any, problem: str
    ) -> evidence.Call:
        answered = self.t if response is not None else math.nan
        self.calls.append(evidence.Call(asked, service, dict(request), response, answered, problem))
        return self.calls[-1]

    def _all_there(self) -> bool:
        services = all(client.service_is_ready() for client in self._clients.values())
        if self.plan.launch:
            return set(self.plan.awaits) <= set(self.bridge.node.get_node_names())
        return services and (self.action is None or self.action.server_is_ready())

    def _why_not_ready(self) -> str:
        code = self.process.exit_code()
        if code is not None:
            return f"the node ended before it came up, with exit status {code}"
        others = ", ".join(self.graph.nodes) if self.graph and self.graph.nodes else "no node at all"
        return f"no node {self.plan.node} came up within 20 s; the graph shows {others}"

    def _take_command(self, t: float, message: Any) -> None:
        if not self._has_room(self.commands):
            return
        others = (message.linear.y, message.linear.z, message.angular.x, message.angular.y)
        other = max((abs(value) for value in others), default=0.0)
        self.commands.append(evidence.Command(t, message.linear.x, message.angular.z, other))

    def _take_published(self, reading: Reading) -> None:
        if isinstance(reading, ScanReading):
            self.scans.append(_summary(reading))
        elif isinstance(reading, ImuReading) and self.plan.node == "sensor_processor":
            data = {
                "linear_acceleration": [float(value) for value in reading.linear_acceleration],
                "angular_velocity": [float(value) for value in reading.angular_velocity],
            }
            self.published.append(evidence.Message(reading.stamp, "imu/data", data))
        elif isinstance(reading, BatteryReading):
            percent = {"percentage": float(reading.percentage)}
            self.published.append(evidence.Message(reading.stamp, "battery/state", percent))

    def _parameters_of(self, node: str) -> AsyncParameterClient:
        """Return the client for a node's parameters. A question asked before its services are found would be lost."""
        client = self._parameter_clients[node]
        self.bridge.spin_until(client.services_are_ready, _ANSWER_WALL_S)
        return client

    def _note_parameter(
        self, name: str, wanted: object, accepted: bool | None, reason: str, node: str
    ) -> evidence.ParameterAnswer:
        future = self._parameters_of(node).get_parameters([name])
        self._await(future.done)
        value = None
        if future.done() and future.result() is not None and future.result().values:
            # A byte array, or ten million numbers, are not what was asked for; they are told as far as they fit.
            value = _tellable(parameter_value_to_python(future.result().values[0]))
        self.parameters.append(evidence.ParameterAnswer(self.t, name, wanted, accepted, value, reason, node))
        return self.parameters[-1]

    def _scene(self) -> dict[str, Any]:
        world = self.simulator.world
        found = {
            # When it was taken away, so that a picture can draw it as something that passed.
            p.obstacle.name: replace(p.obstacle, vanishes=round(p.until, 3)) if math.isfinite(p.until) else p.obstacle
            for p in self.simulator.presences
        }
        return replace(world, obstacles=tuple(found.values())).to_dict()

    def _sample(self) -> None:
        pose, twist, odometry = self.simulator.pose, self.simulator.twist, self.simulator.odometry().pose
        self.samples.append(
            evidence.Sample(
                self.t, pose.x, pose.y, pose.yaw, twist.v, twist.omega, odometry.x, odometry.y, odometry.yaw,
                self.simulator.clearance(),
            )
        )  # fmt: skip


@dataclass(frozen=True)
class _Distorted:
    """Changes the ranges of each scan."""

    change: Callable[[np.ndarray[Any, Any]], np.ndarray[Any, Any]]

    def __call__(self, scan: ScanReading) -> ScanReading:
        return replace(scan, ranges=self.change(np.array(scan.ranges, dtype=float)))


def _tellable(value: Any) -> Any:
    """Return a parameter's value as the evidence can hold it."""
    if value is None or isinstance(value, bool | int | float):
        return value
    return plain(list(value) if isinstance(value, tuple) else value)


def _stands(command: evidence.Command) -> bool:
    return command.v == command.omega == 0.0


def _summary(scan: ScanReading) -> evidence.ScanSummary:
    ranges = np.asarray(scan.ranges, dtype=float)
    angles = scan.angle_min + scan.angle_increment * np.arange(len(ranges))
    ahead = np.cos(angles) >= math.cos(_SECTOR) - 1e-9
    behind = np.cos(angles) <= -math.cos(_SECTOR) + 1e-9
    valid = np.isfinite(ranges) & (ranges >= scan.range_min) & (ranges <= scan.range_max)

    def closest(where: np.ndarray[Any, Any]) -> float:
        found = ranges[valid & where]
        return float(found.min()) if found.size else math.inf

    return evidence.ScanSummary(scan.stamp, closest(ahead), closest(behind), closest(np.ones_like(valid)))


def _topics(plan: TrialPlan) -> Topics:
    """Return what the robot publishes: for the node, and for one beside it."""
    own, other = (CONTROLLER, PROCESSOR) if plan.node == "robot_controller" else (PROCESSOR, CONTROLLER)
    return replace(own, imu=own.imu or other.imu, battery=own.battery or other.battery) if plan.beside else own


def _end(process: Process) -> evidence.ProcessEnd:
    code = process.exit_code()
    by = "us" if code is None else "itself"
    return evidence.ProcessEnd(by, code, round(process.wall_seconds, 2), process.output[-4000:])
