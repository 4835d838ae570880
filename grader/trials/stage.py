"""What a trial's script can do: let time pass, call, send goals, move the world. Everything it does is recorded."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path, PurePosixPath
from types import MappingProxyType
from typing import Any

import numpy as np
from action_msgs.msg import GoalStatusArray
from rcl_interfaces.msg import Log
from rclpy.parameter import Parameter, parameter_value_to_python
from rclpy.parameter_client import AsyncParameterClient
from rclpy.qos import qos_profile_action_status_default
from std_msgs.msg import Float32

from grader import evidence
from grader.sandbox.cpu_clock import WorkClock
from grader.trials import graph
from grader.trials.goal import GoalRun
from grader.trials.interfaces import SERVICES, SensorFusionData
from grader.trials.messages import fill, plain
from grader.trials.observation import ACTION, Program, Running, TrialOver
from grader.trials.service_proxy import Relay
from grader.trials.wire_layout import Read
from sim import Circle
from sim.bridge import TICK_S
from sim.sensors import ScanReading

__all__ = ["SOURCE", "TOPICS", "Stage", "TrialOver"]

_ANSWER_WITHIN_S = 2.0  # simulated, for a service or a goal's acceptance
_ANSWER_WALL_S = 3.0  # the clock stands still so long for an answer before time goes on
TOPICS: dict[str, tuple[Any, int]] = {
    "sensor_fusion_data": (SensorFusionData, 10),
    "obstacle_distance": (Float32, 10),
    "rosout": (Log, 100),
}
"""The topics that a script can listen to."""

SOURCE = Path("/ws/src/ros2_robot_controller")
"""Where a wall shows the package's source."""


@dataclass(frozen=True)
class _Distorted:
    """Changes the ranges of each scan, and what it says of its lidar."""

    change: Callable[[np.ndarray[Any, Any]], np.ndarray[Any, Any]] | None = None
    limits: tuple[float, float] | None = None

    def __call__(self, scan: ScanReading) -> ScanReading:
        range_min, range_max = self.limits or (scan.range_min, scan.range_max)
        ranges = scan.ranges if self.change is None else self.change(np.array(scan.ranges, dtype=float))
        return replace(scan, ranges=ranges, range_min=range_min, range_max=range_max)


class Stage(Running):
    """A node, a robot and a world, in the hands of a trial's script. Times are simulated seconds since the start."""

    _scans = _Distorted()
    readers: Mapping[str, Read] = MappingProxyType({})
    """How to read topics whose messages the submission has laid out in another way than the contract."""

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
            goal.problem = f"there is no action {ACTION} of the contract's type"
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
        read = self.readers.get(topic)

        def take(message: Any) -> None:
            if not self._has_room(self.messages):
                return
            found = read(message) if read else plain(message)
            if found is not None:
                self.messages.append(evidence.Message(self.t, topic, found))

        self.bridge.node.create_subscription(message_type, topic, take, depth, raw=read is not None)

    def mute(self, *kinds: type) -> None:
        """Let these sensors fall silent: ScanReading, OdometryReading, ImuReading, BatteryReading."""
        self.bridge.muted |= set(kinds)

    def unmute(self, *kinds: type) -> None:
        """Let these sensors speak again."""
        self.bridge.muted -= set(kinds)

    def distort(self, change: Callable[[np.ndarray[Any, Any]], np.ndarray[Any, Any]] | None) -> None:
        """Publish scans with their ranges changed from now on; None for the true ones."""
        self._scans = replace(self._scans, change=change)
        self.bridge.filter_scan = self._scans

    def narrow(self, range_min: float, range_max: float) -> None:
        """Publish scans of a lidar with other limits from now on, in metres; the readings stay as they are."""
        self._scans = replace(self._scans, limits=(range_min, range_max))
        self.bridge.filter_scan = self._scans

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
        topic = f"{ACTION}/_action/status"

        def take(message: Any) -> None:
            for status in message.status_list[:20]:
                goal = bytes(status.goal_info.goal_id.uuid).hex()
                if not self._has_room(self.messages):
                    return
                self.messages.append(evidence.Message(self.t, topic, {"goal": goal, "status": status.status}))

        self.bridge.node.create_subscription(GoalStatusArray, topic, take, qos_profile_action_status_default)

    def play(self, script: str) -> Program:
        """Start a Python script of the package's source, by its path in it."""
        process = self.others[PurePosixPath(script).name] = self.start(["python3", str(SOURCE / script)])
        return process

    def interrupt(self, limit: float = 5.0) -> None:
        """Press Ctrl-C: send SIGINT to the node and wait for its end, `limit` seconds at most.

        The seconds are wall time without that in which other processes had the cores: a busy machine gives more.
        """
        self.mark("interrupt")
        self.interrupted = True
        clock = WorkClock(self.process, [os.getpid()])
        self.process.interrupt()
        while self.process.exit_code() is None and clock.look() < limit:
            # The clock goes on: a node that waits for its next message hears of the signal only when that has come.
            self.bridge.tick_by_wall()
        if self.process.exit_code() is not None:
            self.choices["seconds_to_end"] = round(clock.look(), 2)
        # The node's last words may still be on their way.
        self.bridge.alive = lambda: True
        self.bridge.spin_until(lambda: False, 0.05)

    # -- inside ---------------------------------------------------------------------------------------------------

    def _await(self, condition: Callable[[], bool]) -> None:
        """Wait with the clock standing still, which keeps the answer's time exact; if that is no use, let time pass."""
        if self.bridge.pace == "lockstep" and self.bridge.spin_until(condition, _ANSWER_WALL_S):
            return
        self.run_until(condition, _ANSWER_WITHIN_S)

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
            try:
                # A byte array, or ten million numbers, are not what was asked for; they are told as far as they fit.
                value = _tellable(parameter_value_to_python(future.result().values[0]))
            except Exception as error:  # whatever a node calls a parameter's value is its affair, and no fault of ours
                reason = reason or f"an answer that is no parameter's value: {error}"[:300]
        self.parameters.append(evidence.ParameterAnswer(self.t, name, wanted, accepted, value, reason, node))
        return self.parameters[-1]


def _tellable(value: Any) -> Any:
    """Return a parameter's value as the evidence can hold it."""
    if value is None or isinstance(value, bool | int | float):
        return value
    return plain(list(value) if isinstance(value, tuple) else value)
