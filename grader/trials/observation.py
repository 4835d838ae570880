"""A trial while it runs: tick after tick, record everything that is observed, and return it as evidence.

What a script can do is in stage.py.
"""

from __future__ import annotations

import math
import os
import random
import re
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from rclpy.action.client import ActionClient
from rclpy.parameter_client import AsyncParameterClient

from grader import evidence, tracebacks
from grader.course import Course, Node
from grader.evidence import Kind, Reason
from grader.sandbox.cpu_clock import CpuClock
from grader.trials import graph
from grader.trials.cpu_affinity import AffinityTuner
from grader.trials.goal import SentGoal
from grader.trials.interfaces import interface
from grader.trials.plan import TrialPlan
from grader.trials.request import DEAF_S, PATIENCE_S, not_started
from grader.trials.service_proxy import ServiceProxy
from sim.bridge import TICK_S, Bridge, Topics
from sim.sensors import BatteryReading, ImuReading, Reading, ScanReading
from sim.simulator import Simulator

# Rounds of the node's executor after the timer that ends a goal: its task goes on, its future sends it. And one more: a
# round that the clock reaches while it looks for what is ready may miss it, and yet serve the call that came after it.
_GOAL_ROUNDS = 3
_ENDING_ROUNDS = 8
_ENDING_TICKS = 20  # for so long after it has stopped, a robot may have arrived; then it is blocked
# Of each kind of message. An honest trial has a thousand at most; a node that floods us must not fill our memory.
_MAX_KEPT = 20_000
_CLOCK_CHECK_TICKS = 10
_SECTOR = math.radians(60)
_DISCOVERY_S = 2.0  # for something that the node offers and that is not seen yet; excludes time spent waiting for a CPU
_DUMP_S = 2.0  # for a node to write down where it hangs
# Words without which a package has one thread that serves its callbacks.
_THREADS = re.compile(r"(?<!Single)Thread|CallbackGroup|multiprocessing|concurrent|asyncio|EventsExecutor")


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


class Program(Protocol):
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

    def thread_times(self) -> dict[int, tuple[float, float]]:
        """Return for each of its threads the seconds that it has run, and has waited for a core."""

    def cpu_seconds(self) -> float:
        """Return the CPU time that all its processes have used, those that have ended included."""

    def pin_to(self, cores: Iterable[int]) -> None:
        """Let all its threads run on these cores only."""

    def abort(self) -> None:
        """Send it SIGABRT, on which Python's faulthandler writes down what each thread was doing."""


def has_one_thread(package: Path) -> bool:
    """Return whether nothing in a package's code says that it serves callbacks in several threads."""
    files = [path for path in package.rglob("*") if path.suffix in ("", ".py") and path.is_file()]
    code = [path for path in files if path.relative_to(package).parts[0] not in ("test", "tests", ".git")]
    return bool(code) and not any(_THREADS.search(path.read_bytes().decode("utf-8", "replace")) for path in code)


class Observation:
    """A node, a robot and a world under observation. Times are simulated seconds since the start."""

    def __init__(
        self,
        course: Course,
        plan: TrialPlan,
        seed: int,
        simulator: Simulator,
        process: Program,
        domain_id: int,
        *,
        reliable: bool = True,
    ) -> None:
        self.course = course
        self.plan = plan
        self.contract = course.nodes[plan.node]
        self._reliable = reliable
        self.patience_s = PATIENCE_S
        self.simulator = simulator
        self.process = process
        # Seeded with a string, so that each trial draws its own numbers from the instructor's one seed.
        self.random = random.Random(f"{seed}:{plan.name}")
        self.bridge = Bridge(
            simulator,
            _topics(course, plan),
            plan.node,
            domain_id=domain_id,
            alive=lambda: process.exit_code() is None,
            reliable=reliable,
            namespace=plan.namespace,
        )
        self.bridge.on_command = self._take_command
        self.bridge.on_published = self._take_published
        self.start: Callable[[Sequence[str]], Program]
        """Start another command of the submission in the same sandbox; set by the worker."""
        self.others: dict[str, Program] = {}
        self._service_proxy: ServiceProxy | None = None
        self._domain_id = domain_id
        self.ready = False
        self.interrupted = False
        self.recorded = not_started(plan, simulator.seed)
        """The lists and dictionaries of the trial's facts, filled as it goes; `facts` completes them."""
        self.choices, self.measured, self.in_files = (
            self.recorded.choices,
            self.recorded.measured,
            self.recorded.in_files,
        )
        self.marks, self.commands = self.recorded.marks, self.recorded.commands
        self.goals: list[SentGoal] = []
        self.graph: evidence.Graph | None = None
        self.other_graph: evidence.Graph | None = None
        self._foreign: list[str] = []
        self._dropped = 0
        self._started = time.monotonic()
        self._clock = CpuClock(process, [os.getpid()])
        self._work_limit_s = 120.0
        self._deaf_s = 0.0
        self.has_one_thread = False
        """Whether the node is deaf when it answers no call, even if it publishes: it has one thread for both."""
        self._aborted = False
        self._standing_ticks = 0
        self._sought: set[str] = set()
        self._affinity = AffinityTuner(process.pin_to, self._clock.seconds)
        node = self.bridge.node
        self._clients: dict[str, Any] = {}
        self.action: Any = None
        self.action_type: Any = None
        self.action_name = next(iter(self.contract.actions), "")
        self._parameter_clients = {name: AsyncParameterClient(node, name) for name in {plan.node, *plan.awaits}}
        space = f"{plan.namespace}/" if plan.namespace else ""
        self._service_types = {name: interface(type_) for name, type_ in self.contract.services.items()}
        for name, type_ in self._service_types.items():
            self._clients[name] = node.create_client(type_, space + plan.remappings.get(name, name))
        if self.action_name:
            self.action_type = interface(self.contract.actions[self.action_name])
            self.action = ActionClient(node, self.action_type, space + self.action_name)
        answer = self.bridge.topics.answer
        if answer and answer != self.bridge.topics.command:
            self.bridge.watch_answers(interface(self.contract.publishes[answer]))

    @property
    def t(self) -> float:
        """Return the simulated time since the trial began, in seconds: `began = stage.t`."""
        return self.bridge.time

    def open(self) -> None:
        """Wait for the node to come up and record the graph.

        Raises:
            TrialOver: the node does not come up.
        """
        # The nodes of a launch file come up one after another, seconds apart on a busy machine.
        quiet = {"quiet_s": 3.0} if self.plan.launch else {}
        self.ready = self.bridge.await_node(self._all_there, self.patience_s, clock=self._clock.seconds, **quiet)
        self.graph = graph.snapshot(self.bridge.node, self.plan.node)
        if not self.ready:
            raise TrialOver(self._why_not_ready())
        if self.plan.real_time:
            self.bridge.pace = "real time"
        self._sample()

    def facts(self, ended: Reason | None, script_error: str) -> evidence.Trial:
        """Return everything that was recorded, once what the node has published so far has arrived."""
        self.bridge.drain()
        return replace(
            self.recorded,
            ready=self.ready,
            pace=self.bridge.pace,
            ended=ended,
            script_error=script_error,
            touches=[
                evidence.Touch(contact.time, contact.obstacle, contact.speed) for contact in self.simulator.contacts
            ],
            goals=[goal.facts() for goal in self.goals],
            scene=self._scene(),
            graph=self.graph,
            other_graph=self.other_graph,
            launch=self.plan.launch,
            process=_end(self.process, "interrupt" if self.interrupted else "us" if self._aborted else "itself"),
            wall_seconds=round(time.monotonic() - self._started, 2),
            others={name: _end(process) for name, process in self.others.items()},
            foreign=self._foreign_publishers(),
            dropped=self._dropped,
            deaf_to=self._deaf_to(),
            stopped=self.process.stopped(),
        )

    def close(self) -> None:
        """Leave the graph."""
        if self._service_proxy is not None:
            self._service_proxy.close()
        if self.action is not None:
            self.action.destroy()  # destroying a node destroys all that belongs to it but its action clients
        self.bridge.close()

    def _tick(self, dt: float = TICK_S) -> None:
        code = self.process.exit_code()
        if code is not None:
            raise TrialOver(Reason(Kind.DIED, exit_code=code, seconds=round(self.t, 2)))
        if self._clock.seconds() > self._work_limit_s:
            raise TrialOver(Reason(Kind.SLOW, seconds=self._work_limit_s))
        going = any(goal.running for goal in self.goals)
        before, heard = self._clock.seconds(), self._signs_of_life()
        self.bridge.tick(dt, further_rounds=_GOAL_ROUNDS if going else 0)
        # Only within ticks: in a notebook, minutes may pass between two of them.
        silent = self.bridge.can_ask and self._signs_of_life() == heard
        self._deaf_s = self._deaf_s + self._clock.seconds() - before if silent else 0.0
        if self._deaf_s > DEAF_S:
            raise TrialOver(self._where_it_hangs())
        if self.bridge.pace == "lockstep":
            self._affinity.tick()
        stands = bool(self.commands) and self.commands[-1].v == self.commands[-1].omega == 0.0
        self._standing_ticks = self._standing_ticks + 1 if going and stands else 0
        if 0 < self._standing_ticks <= _ENDING_TICKS:
            # The robot may have arrived: from the timer that stops it to the result takes some rounds.
            self.bridge.settle(_ENDING_ROUNDS)
        self._sample()
        if len(self.recorded.samples) % _CLOCK_CHECK_TICKS == 0 and self.bridge.node.count_publishers("/clock") > 1:
            self._foreign_publishers()
        if any(goal.silent for goal in self.goals):
            self.bridge.await_feedback()

    def _signs_of_life(self) -> int:
        return self.bridge.served if self.has_one_thread else self.bridge.heard

    def _where_it_hangs(self) -> Reason:
        """End a deaf node, and return that it is deaf, and where it was if Python says so."""
        self._aborted = True
        self.process.abort()
        end = self._clock.read() + _DUMP_S
        while self.process.exit_code() is None and self._clock.seconds() < end:
            time.sleep(0.01)
        return Reason(Kind.HANGS, seconds=DEAF_S, place=tracebacks.hanging_place(self.process.output))

    def _wait_until(self, condition: Callable[[], bool], seconds: float) -> bool:
        """Wait with the clock standing still until `condition` holds. Return whether it does.

        The seconds exclude time spent waiting for a CPU.
        """
        end = self._clock.read() + seconds
        while not self.bridge.spin_until(condition, 0.1):
            if self._clock.seconds() > end or not self.bridge.alive():
                return condition()
        return True

    def _found(self, name: str, condition: Callable[[], bool]) -> bool:
        """Return whether `condition` holds, which tells that what the node offers as `name` has been discovered.

        Waits for it as long as discovery may take, but only once in a trial, because it may not exist.
        """
        if name in self._sought or condition():
            return condition()
        self._sought.add(name)
        return self._wait_until(condition, _DISCOVERY_S)

    def _foreign_publishers(self) -> list[str]:
        """Return who else has published, at any time so far, what only the simulator should publish."""
        self._foreign = graph.foreign_publishers(self.bridge.node, ["/clock", *self._own_topics()], self._foreign)
        return self._foreign

    def _note_call(
        self, asked: float, service: str, request: dict[str, object], response: Any, problem: Reason | None = None
    ) -> evidence.Call:
        answered = self.t if response is not None else math.nan
        self.recorded.calls.append(evidence.Call(asked, service, dict(request), response, answered, problem))
        return self.recorded.calls[-1]

    def _may_keep(self, kept: list[Any]) -> bool:
        """Return whether one more message may be kept; count it as dropped if not."""
        full = len(kept) >= _MAX_KEPT
        self._dropped += full
        return not full

    def _own_topics(self) -> list[str]:
        """Return the sensors' topics, which only the simulator should publish."""
        topics = self.bridge.topics
        return [f"/{name}" for name in (topics.scan, topics.odom, topics.imu, topics.battery) if name]

    def _deaf_to(self) -> list[str]:
        """Return the sensors' topics of which the node can receive nothing because it asks for reliable ones."""
        ends = self.graph.endpoints if self.graph and not self._reliable else []
        wanted = {end.topic for end in ends if end.kind == "subscription" and end.reliability == "reliable"}
        return sorted(wanted & {name.lstrip("/") for name in self._own_topics()})

    def _all_there(self) -> bool:
        services = all(client.service_is_ready() for client in self._clients.values())
        if self.plan.launch:
            return set(self.plan.awaits) <= set(self.bridge.node.get_node_names())
        return services and (self.action is None or self.action.server_is_ready())

    def _why_not_ready(self) -> Reason:
        code, launch = self.process.exit_code(), self.plan.launch
        if code is not None:
            return Reason(Kind.DIED_EARLY, launch=launch, exit_code=code)
        nodes = tuple(self.graph.nodes) if self.graph else ()
        return Reason(Kind.NOT_UP, self.plan.node, launch=launch, seconds=self.patience_s, nodes=nodes)

    def _take_command(self, t: float, message: Any) -> None:
        if not self._may_keep(self.commands):
            return
        others = (message.linear.y, message.linear.z, message.angular.x, message.angular.y)
        other = max((abs(value) for value in others), default=0.0)
        self.commands.append(evidence.Command(t, message.linear.x, message.angular.z, other))

    def _take_published(self, reading: Reading) -> None:
        if isinstance(reading, ScanReading):
            self.recorded.scans.append(_summary(reading))
        elif isinstance(reading, ImuReading) and _topics_of(self.contract).imu:
            data = {
                "linear_acceleration": [float(value) for value in reading.linear_acceleration],
                "angular_velocity": [float(value) for value in reading.angular_velocity],
            }
            self.recorded.published.append(evidence.Message(reading.stamp, self.bridge.topics.imu, data))
        elif isinstance(reading, BatteryReading):
            percent = {"percentage": float(reading.percentage)}
            self.recorded.published.append(evidence.Message(reading.stamp, self.bridge.topics.battery, percent))

    def _scene(self) -> dict[str, Any]:
        world = self.simulator.world
        found = {
            # When it was removed, so that a picture can draw it as temporary.
            p.obstacle.name: replace(p.obstacle, vanishes=round(p.until, 3)) if math.isfinite(p.until) else p.obstacle
            for p in self.simulator.presences
        }
        return replace(world, obstacles=tuple(found.values())).to_dict()

    def _sample(self) -> None:
        pose, twist, odometry = self.simulator.pose, self.simulator.twist, self.simulator.odometry().pose
        self.recorded.samples.append(
            evidence.Sample(
                self.t, pose.x, pose.y, pose.yaw, twist.v, twist.omega, odometry.x, odometry.y, odometry.yaw,
                self.simulator.clearance(),
            )
        )  # fmt: skip


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


def _end(process: Program, by: str = "itself") -> evidence.ProcessEnd:
    code = process.exit_code()
    by = "us" if code is None else by
    return evidence.ProcessEnd(by, code, round(process.wall_seconds, 2), process.output[-4000:])
