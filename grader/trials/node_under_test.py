"""The node of a trial from outside: its process, its clients on the graph, and whether it still answers."""

from __future__ import annotations

import os
import re
import time
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any, Protocol

from rclpy.action.client import ActionClient
from rclpy.parameter_client import AsyncParameterClient

from grader import evidence, tracebacks
from grader.course import Course, Node
from grader.evidence import Kind, Reason
from grader.sandbox.cpu_clock import CpuClock, Timed
from grader.trials import graph
from grader.trials.messages import interface
from grader.trials.plan import TrialPlan
from grader.trials.request import BEHIND_S, DEAF_S, PATIENCE_S
from sim.bridge import Bridge, Topics
from sim.simulator import Simulator

# Rounds of the node's executor after the timer that ends a goal: its task goes on, its future sends it. And one more: a
# round that the clock reaches while it looks for what is ready may miss it, and yet serve the call that came after it.
_GOAL_ROUNDS = 3
_DISCOVERY_S = 2.0  # for something that the node offers and that is not seen yet; excludes time spent waiting for a CPU
_DUMP_S = 2.0  # for a node to write down where it hangs
_WORK_LIMIT_S = 120.0
# Words without which a package has one thread that serves its callbacks.
_THREADS = re.compile(r"(?<!Single)Thread|CallbackGroup|multiprocessing|concurrent|asyncio|EventsExecutor")

SEND_GOAL = "/_action/send_goal"
"""Behind an action's name the service that takes goals."""
_ROLES = {
    "sensor_msgs/msg/LaserScan": "scan", "nav_msgs/msg/Odometry": "odom",
    "sensor_msgs/msg/Imu": "imu", "sensor_msgs/msg/BatteryState": "battery",
}  # fmt: skip
"""What the robot publishes on a topic of this type."""


class TrialOver(Exception):
    """The script cannot go on. What was recorded so far is evidence all the same."""

    def __init__(self, reason: Reason) -> None:
        super().__init__(str(reason))
        self.reason = reason


class Program(Timed, Protocol):
    """A running program of the submission's: in a sandbox for grading, an ordinary process in a notebook."""

    @property
    def wall_seconds(self) -> float:
        """Return how long ago it was started."""

    @property
    def output(self) -> str:
        """Return its output, stdout and stderr together."""

    def exit_code(self) -> int | None:
        """Return its exit code, None while it runs."""

    def has_ended(self) -> bool:
        """Return whether it has ended; its exit code may follow."""

    def interrupt(self) -> None:
        """Send it SIGINT, as Ctrl-C does."""

    def stopped(self) -> str:
        """Return the limit that it exceeded, "" if none."""

    def abort(self) -> None:
        """Send it SIGABRT, on which Python's faulthandler writes down what each thread was doing."""


def has_one_thread(package: Path) -> bool:
    """Return whether nothing in a package's code says that it serves callbacks in several threads."""
    files = [path for path in package.rglob("*") if path.suffix in ("", ".py") and path.is_file()]
    code = [path for path in files if path.relative_to(package).parts[0] not in ("test", "tests", ".git")]
    return bool(code) and not any(_THREADS.search(path.read_bytes().decode("utf-8", "replace")) for path in code)


class NodeUnderTest:
    """A running node of the submission's on a graph with a simulated robot.

    Args:
        one_thread: whether the node is deaf when it answers no call, even if it publishes: one thread does both.
        reliable: whether the robot's sensors publish reliably.
        patience_s: how long the node may take to come up, and `work_limit_s` how long its trial may work. Both exclude
            time spent waiting for a CPU.
    """

    def __init__(
        self,
        course: Course,
        plan: TrialPlan,
        simulator: Simulator,
        process: Program,
        domain_id: int,
        *,
        one_thread: bool,
        reliable: bool = True,
        patience_s: float = PATIENCE_S,
        work_limit_s: float = _WORK_LIMIT_S,
    ) -> None:
        self.plan, self.contract, self.process = plan, course.nodes[plan.node], process
        self.domain_id = domain_id
        self._one_thread, self._reliable = one_thread, reliable
        self._patience_s, self._work_limit_s = patience_s, work_limit_s
        self.bridge = Bridge(
            simulator,
            _topics(course, plan),
            plan.node,
            domain_id=domain_id,
            alive=lambda: process.exit_code() is None,
            reliable=reliable,
            namespace=plan.namespace,
        )
        # The robot's battery is recorded for a node beside, too; its IMU publishes too often for that.
        self.recorded_topics = replace(self.bridge.topics, imu=_topics_of(self.contract).imu)
        self.ready = False
        self.graph: evidence.Graph | None = None
        self.aborted = False
        """Whether it was ended because it was deaf."""
        self._foreign: list[str] = []
        self._clock = CpuClock(process, [os.getpid()])
        self._deaf_s = self._waited_s = 0.0
        self._sought: set[str] = set()
        node, space = self.bridge.node, f"{plan.namespace}/" if plan.namespace else ""
        self._parameter_clients = {name: AsyncParameterClient(node, name) for name in {plan.node, *plan.awaits}}
        self.service_types = {name: interface(type_) for name, type_ in self.contract.services.items()}
        self.services: dict[str, Any] = {
            name: node.create_client(type_, space + plan.remappings.get(name, name))
            for name, type_ in self.service_types.items()
        }
        self.action: Any = None
        self.action_type: Any = None
        self.action_name = next(iter(self.contract.actions), "")
        if self.action_name:
            self.action_type = interface(self.contract.actions[self.action_name])
            self.action = ActionClient(node, self.action_type, space + self.action_name)
        answer = self.bridge.topics.answer
        if answer and answer != self.bridge.topics.command:
            self.bridge.watch_answers(interface(self.contract.publishes[answer]))

    def await_start(self) -> None:
        """Wait for the node to come up and record the graph.

        Raises:
            TrialOver: the node does not come up.
        """
        # The nodes of a launch file come up one after another, seconds apart on a busy machine.
        quiet = {"quiet_s": 3.0} if self.plan.launch else {}
        self.ready = self.bridge.await_node(self._all_there, self._patience_s, clock=self._clock.seconds, **quiet)
        self.record_graph()
        if not self.ready:
            raise TrialOver(self._why_not_ready())
        if self.plan.real_time:
            self.bridge.pace = "real time"

    def go_on(self, plan: TrialPlan, simulator: Simulator) -> None:
        """Go on with another trial of the same running node, whose robot rests where it is."""
        self.plan = plan
        self.bridge.go_on(simulator)
        self._foreign = []
        self._clock = CpuClock(self.process, [os.getpid()])
        self._deaf_s = self._waited_s = 0.0

    def tick(self, dt: float, *, ending: bool) -> None:
        """Let one tick of `dt` simulated seconds pass; `ending` is whether the node may end a goal in it.

        Raises:
            TrialOver: the node has ended, answers nothing any more, waits for too long by itself, or its trial has
                worked for too long.
        """
        code = self.process.exit_code()
        if code is not None:
            raise TrialOver(Reason(Kind.DIED, exit_code=code, seconds=round(self.bridge.time, 2)))
        if self._clock.seconds() > self._work_limit_s:
            raise TrialOver(Reason(Kind.SLOW, seconds=self._work_limit_s))
        before, idle, heard = self._clock.seconds(), self._clock.idle, self._signs_of_life()
        self.bridge.tick(dt, further_rounds=_GOAL_ROUNDS if ending else 0)
        # Only within ticks: in a notebook, minutes may pass between two of them.
        self._note_silence(before, heard)
        self._waited_s += self._clock.idle - idle
        if self.behind_s > BEHIND_S:
            raise TrialOver(self._stopped(Kind.WAITS, BEHIND_S))

    def finish(self) -> None:
        """Wait, at a trial's end, for a node that answers nothing, as long as it may.

        Simulated time that goes by the wall may be over before that, if the node waits for a CPU.

        Raises:
            TrialOver: the node answers nothing any more.
        """
        while self._deaf_s and self.process.exit_code() is None:
            before, heard = self._clock.seconds(), self._signs_of_life()
            self.bridge.drain()
            self._note_silence(before, heard)

    def _note_silence(self, before: float, heard: int) -> None:
        """Count how long the node has answered nothing since `before`, when it had given these signs of life."""
        silent = self.bridge.can_ask and self._signs_of_life() == heard
        self._deaf_s = self._deaf_s + self._clock.seconds() - before if silent else 0.0
        if self._deaf_s > DEAF_S:
            raise TrialOver(self._stopped(Kind.HANGS, DEAF_S))

    @property
    def behind_s(self) -> float:
        """Return how much longer the trial's ticks have waited than a robot would have taken; at least 0."""
        return max(self._waited_s - self.bridge.time, 0.0)

    def wait_until(self, condition: Callable[[], bool], seconds: float) -> bool:
        """Wait with the clock standing still until `condition` holds. Return whether it does.

        The seconds exclude time spent waiting for a CPU.
        """
        end = self._clock.read() + seconds
        while not self.bridge.spin_until(condition, 0.1):
            if self._clock.seconds() > end or not self.bridge.alive():
                return condition()
        return True

    def found(self, name: str, condition: Callable[[], bool]) -> bool:
        """Return whether `condition` holds, which tells that what the node offers as `name` has been discovered.

        Waits for it as long as discovery may take, but only once in a trial, because it may not exist.
        """
        if name in self._sought or condition():
            return condition()
        self._sought.add(name)
        return self.wait_until(condition, _DISCOVERY_S)

    def await_topics(self, node: str, topics: Iterable[str]) -> None:
        """Wait until the graph shows that `node` has these topics, as long as discovery may take."""
        wanted = set(topics)
        self.found(f"topics of {node}", lambda: wanted <= {e.topic for e in graph.endpoints(self.bridge.node, node)})

    def parameters_of(self, node: str) -> AsyncParameterClient:
        """Return the client for a node's parameters. A request sent before its services are found would be lost."""
        client = self._parameter_clients[node]
        self.found(f"parameters of {node}", client.services_are_ready)
        return client

    def record_graph(self) -> None:
        """Record what the graph shows of the node now."""
        self.graph = graph.snapshot(self.bridge.node, self.plan.node)

    def foreign_publishers(self) -> list[str]:
        """Return who else has published, at any time so far, what only the simulator should publish."""
        self._foreign = graph.foreign_publishers(self.bridge.node, ["/clock", *self._sensor_topics()], self._foreign)
        return self._foreign

    def deaf_to(self) -> list[str]:
        """Return the sensors' topics of which the node can receive nothing because it asks for reliable ones."""
        ends = self.graph.endpoints if self.graph and not self._reliable else []
        wanted = {end.topic for end in ends if end.kind == "subscription" and end.reliability == "reliable"}
        return sorted(wanted & {name.lstrip("/") for name in self._sensor_topics()})

    def close(self) -> None:
        """Leave the graph."""
        if self.action is not None:
            self.action.destroy()  # destroying a node destroys all that belongs to it but its action clients
        self.bridge.close()

    def _signs_of_life(self) -> int:
        return self.bridge.served if self._one_thread else self.bridge.heard

    def _stopped(self, kind: Kind, seconds: float) -> Reason:
        """End a node that does not go on; return where it was, or the exception of which its thread died."""
        self.aborted = True
        self.process.abort()
        end = self._clock.read() + _DUMP_S
        while self.process.exit_code() is None and self._clock.seconds() < end:
            time.sleep(0.01)
        output = self.process.output
        said, place = tracebacks.raised(output)
        if said and tracebacks.IN_THREAD in output:
            return Reason(Kind.RAISED, said=said, place=place)
        return Reason(kind, seconds=seconds, place=tracebacks.hanging_place(output))

    def _sensor_topics(self) -> list[str]:
        topics = self.bridge.topics
        return [f"/{name}" for name in (topics.scan, topics.odom, topics.imu, topics.battery) if name]

    def _all_there(self) -> bool:
        if self.plan.launch:
            return set(self.plan.awaits) <= set(self.bridge.node.get_node_names())
        services = all(client.service_is_ready() for client in self.services.values())
        elsewhere = f"{self.action_name}{SEND_GOAL}" in self.plan.remappings
        return services and (self.action is None or elsewhere or self.action.server_is_ready())

    def _why_not_ready(self) -> Reason:
        code, launch = self.process.exit_code(), self.plan.launch
        if code is not None:
            return Reason(Kind.DIED_EARLY, launch=launch, exit_code=code)
        nodes = tuple(self.graph.nodes) if self.graph else ()
        return Reason(Kind.NOT_UP, self.plan.node, launch=launch, seconds=self._patience_s, nodes=nodes)


def _topics(course: Course, plan: TrialPlan) -> Topics:
    """Return the robot's topics: those for the node, and for a node beside it; none for nodes that have other names.

    To wait until the node has found topics that it will never look for took three seconds.
    """
    if plan.namespace:
        return Topics()
    topics = _topics_of(course.nodes[plan.node])
    for other in map(_topics_of, (course.nodes[name] for name in plan.beside)):
        topics = replace(topics, imu=topics.imu or other.imu, battery=topics.battery or other.battery)
    return topics


def _topics_of(node: Node) -> Topics:
    """Return the topics of the robot that a node has by its contract: one of each type."""
    names = {_ROLES[type_]: name for name, type_ in node.subscribes.items() if type_ in _ROLES}
    return Topics(**names, command=node.command, answer=node.answers_on, answer_s=node.answers_every_s)
