"""What a trial's script can do: let time pass, call, send goals, change the world. Everything is recorded."""

from __future__ import annotations

import dataclasses
import math
import os
import random
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path, PurePosixPath
from types import MappingProxyType
from typing import Any

import numpy as np
from action_msgs.msg import GoalStatusArray
from rcl_interfaces.msg import Log
from rclpy.parameter import Parameter, parameter_value_to_python
from rclpy.qos import qos_profile_action_status_default

from grader import evidence, tracebacks
from grader.course import Course, GoalFields
from grader.evidence import Kind, Reason
from grader.host import dds_sockets
from grader.sandbox.cpu_clock import CpuClock
from grader.trials import graph
from grader.trials.messages import LOG_QOS, Reader, fill, interface, plain, set_back
from grader.trials.node_under_test import SEND_GOAL, NodeUnderTest, Program
from grader.trials.plan import TrialPlan
from grader.trials.recorder import ANSWER_WALL_S, SentGoal, TrialRecorder
from grader.trials.service_proxy import ServiceProxy
from sim import Circle
from sim.bridge import TICK_S
from sim.obstacles import Path as Motion
from sim.sensors import ScanReading
from sim.simulator import Simulator

_ENDING_ROUNDS = 8  # of the node's executor, from the timer that stops the robot to the result of its goal
_ENDING_TICKS = 20  # for so long after it has stopped, a robot may have arrived; then it is blocked
_CLOCK_CHECK_TICKS = 10
_ANSWER_WITHIN_S = 2.0  # simulated, for a service or a goal's acceptance
_SHOW_ARGS_WALL_S = 30.0  # a launch file that takes longer leaves the check unjudged, and costs no points
_LAST_WORD_S = 1.0  # for the last command of a node that has ended, while that is not zero
_EXIT_CODE_WALL_S = 30.0  # for the processes through which a sandbox tells it, even on a very busy machine
_FAR_M = 10.0  # farther than an obstacle gets that moves
LOG_TOPIC = "rosout"
LAUNCH = ("python3", "/ws/ros2", "launch")
"""How the command begins that runs a launch file."""

ChangeRanges = Callable[[np.ndarray[Any, Any]], np.ndarray[Any, Any]]


def source_folder(course: Course) -> Path:
    """Return the package's source folder in the sandbox."""
    return Path("/ws/src", course.package)


def _start_nothing(command: Sequence[str]) -> Program:
    raise RuntimeError(f"this stage starts no other command: {' '.join(command)}")


class Stage:
    """A node, a robot and a world, controlled by a trial's script. Times are simulated seconds since the start.

    Args:
        plan, seed: the trial, and the instructor's seed, from which each trial draws its own numbers.
        simulator: the robot and its world.
        node: the running node.
        recorder: collects the facts; one of its own by default.
        start: starts another command of the submission in the node's sandbox.
        launch_file: where the sandbox has the trial's launch file.
        others: programs that run beside the node, by name.
        readers: by topic, how to read messages whose fields the submission has in another order than the contract.

    The node's output so far is that of trials before.
    """

    def __init__(
        self,
        course: Course,
        plan: TrialPlan,
        seed: int,
        simulator: Simulator,
        node: NodeUnderTest,
        *,
        recorder: TrialRecorder | None = None,
        start: Callable[[Sequence[str]], Program] = _start_nothing,
        others: Mapping[str, Program] = MappingProxyType({}),
        launch_file: str = "",
        readers: Mapping[str, Reader] = MappingProxyType({}),
    ) -> None:
        self.course, self.plan, self.contract = course, plan, node.contract
        self.simulator, self.node, self.bridge = simulator, node, node.bridge
        self.recorder = recorder or TrialRecorder(plan, simulator, node.recorded_topics, node.contract.ahead_deg)
        self.recorded = self.recorder.facts
        self.commands, self.choices, self.measured = (
            self.recorded.commands,
            self.recorded.choices,
            self.recorded.measured,
        )
        # Seeded with a string, so that each trial draws its own numbers from the instructor's one seed.
        self.random = random.Random(f"{seed}:{plan.name}")
        self.bridge.on_command = self.recorder.take_command
        self.bridge.on_published = self.recorder.take_published
        self._start, self._launch_file, self.readers = start, launch_file, readers
        self._others = dict(others)
        self._change: ChangeRanges | None = None
        self._limits: tuple[float, float] | None = None
        self._service_proxy: ServiceProxy | None = None
        self._other_graph: evidence.Graph | None = None
        self._interrupted = False
        self._standing_ticks = 0
        self._said_before = len(node.process.output) if node.ready else 0
        self._started = time.monotonic()

    @property
    def t(self) -> float:
        """Return the simulated time since the trial began, in seconds: `began = stage.t`."""
        return self.bridge.time

    def open(self) -> None:
        """Wait for the node to come up and record the graph.

        Raises:
            TrialOver: the node does not come up.
        """
        if not self.node.ready:
            self.node.await_start()
        self.recorder.sample(self.t)

    def facts(self, ended: Reason | None, script_error: str) -> evidence.Trial:
        """Return everything that was recorded, once what the node has published so far has arrived."""
        self.bridge.drain()
        node, process = self.node, self.node.process
        return self.recorder.complete(
            ready=node.ready,
            pace=self.bridge.pace,
            ended=ended,
            script_error=script_error,
            graph=node.graph,
            other_graph=self._other_graph,
            launch=self.plan.launch,
            process=_end(
                process, "interrupt" if self._interrupted else "us" if node.aborted else "itself", self._said_before
            ),
            wall_seconds=round(time.monotonic() - self._started, 2),
            others={name: _end(other) for name, other in self._others.items()},
            foreign=node.foreign_publishers(),
            deaf_to=node.deaf_to(),
            stopped=process.stopped(),
            behind_s=round(node.behind_s, 1),
        )

    def close(self) -> None:
        """Leave the graph."""
        if self._service_proxy is not None:
            self._service_proxy.close()
        self.node.close()

    # -- seeded choices -------------------------------------------------------------------------------------------

    def choose(self, name: str, options: Sequence[float]) -> float:
        """Return one of `options`, picked by the seed, and record it under `name`: `stage.choose("speed", [0.1, 0.2])`.

        A check finds it as `trial.choices["speed"]`.
        """
        self.choices[name] = self.random.choice(list(options))
        return self.choices[name]

    def between(self, name: str, low: float, high: float) -> float:
        """Return a number picked by the seed, and record it: `stage.between("distance", 0.35, 0.45)`; see `choose`."""
        self.choices[name] = round(self.random.uniform(low, high), 3)
        return self.choices[name]

    # -- time -----------------------------------------------------------------------------------------------------

    def mark(self, name: str) -> None:
        """Record the present time, in s, under `name`: `stage.mark("asked")` for `trial.marks["asked"]`."""
        self.recorded.marks[name] = self.t

    def run(self, seconds: float, tick_s: float = TICK_S) -> None:
        """Let `seconds` of simulated time pass, in steps of `tick_s` seconds: `stage.run(2.0)`.

        A timer of the node runs at most once in a step.
        """
        for _ in range(max(1, round(seconds / tick_s))):
            self._tick(tick_s)

    def run_timed(self, name: str, seconds: float) -> None:
        """Let simulated time pass and measure how long the node kept it waiting: `stage.run_timed("kept", 2.0)`.

        In wall seconds for each second, `trial.measured["kept"]`. They exclude the time that the node ran or waited for
        a CPU, so they are what it sleeps away in its callbacks.
        """
        clock = CpuClock(self.node.process, [os.getpid()])
        before = clock.read() - clock.ran
        self.run(seconds)
        self.measured[name] = round((clock.read() - clock.ran - before) / seconds, 3)

    def run_slowly(self, seconds: float) -> None:
        """Let simulated time pass, and for each tick four times as much wall time: `stage.run_slowly(0.5)`."""
        for _ in range(round(seconds / TICK_S)):
            self._tick()
            self.bridge.spin_until(lambda: False, 4 * TICK_S)

    def run_until(self, condition: Callable[[], bool], limit: float) -> bool:
        """Let time pass until `condition` holds, at most `limit` simulated seconds. Return whether it holds.

        `stage.run_until(lambda: bool(stage.commands), 2.0)`
        """
        end = self.t + limit - 1e-9
        while not condition():
            if self.t >= end:
                return False
            self._tick()
        return True

    def freeze_clock(self, wall_seconds: float) -> int:
        """Let the clock stand still and return how often the node publishes on its answer topic meanwhile.

        `stage.measured["held"] = stage.freeze_clock(1.0)`
        """
        before = self.bridge.answers
        self.bridge.spin_until(lambda: False, wall_seconds)
        return self.bridge.answers - before

    # -- services, goals, parameters ------------------------------------------------------------------------------

    def call(self, service: str, **fields: object) -> evidence.Call:
        """Call a service of the contract and wait for the answer: `stage.call("patrol", data=True)`.

        The fields are those of the request. An answer that has not come after 2 s of simulated time is recorded as
        missing; that is not an error.
        """
        client = self.node.services[service]
        asked = self.t
        if not self.node.found(service, client.service_is_ready):
            return self.recorder.note_call(asked, service, fields, None, problem=Reason(Kind.NO_SERVICE, service))
        future = client.call_async(fill(self.node.service_types[service].Request(), dict(fields)))
        self._await(future.done)
        if not future.done():
            client.remove_pending_request(future)
            problem = Reason(Kind.NO_ANSWER, service, seconds=_ANSWER_WITHIN_S)
            return self.recorder.note_call(asked, service, fields, None, problem=problem)
        response = future.result()
        self.bridge.settle()
        return self.recorder.note_call(asked, service, fields, plain(response))

    def proxy_services(self, services: Iterable[str]) -> None:
        """Offer services in the node's place and forward the calls to it, so that calls made by others are recorded.

        `stage.proxy_services(["patrol"])` in a trial with `remappings={"patrol": "patrol_itself"}`.
        Of an action it is the service that takes goals, such as "drive/_action/send_goal".
        Lets time pass until the node's own services have been found, or as long as an answer may take.
        """
        types = dict(self.node.service_types)
        if self.node.action is not None:
            types[f"{self.node.action_name}{SEND_GOAL}"] = self.node.action_type.Impl.SendGoalService
        targets = {service: (types[service], self.plan.remappings[service]) for service in services}

        def note(service: str, request: Any, answer: Any) -> None:
            asked = {"goal": _id(request)} if service.endswith(SEND_GOAL) else plain(request)
            self.recorder.note_call(self.t, service, asked, plain(answer))

        self._service_proxy = ServiceProxy(self.node.domain_id, targets, note)
        self.run_until(self._service_proxy.is_ready, _ANSWER_WITHIN_S)

    def navigate(self, x: float, y: float, tolerance: float = 0.1) -> SentGoal:
        """Send a goal and wait until it is accepted or rejected: `goal = stage.navigate(1.0, 0.5)`.

        The contract's `goal` names the action's fields. Position in the odom frame and tolerance, in metres.
        `goal.running`, `goal.ended` and `goal.cancel()` go on.
        """
        found = self.node.found(self.node.action_name, self.node.action.server_is_ready)
        if self.course.goal is None:
            fields = ", ".join(f"{each.name}: FIELD" for each in dataclasses.fields(GoalFields))
            raise ValueError(f"the contract has no `goal`; write the action's fields into it: goal: {{{fields}}}")
        goal = SentGoal(self.node, self.course.goal, x, y, tolerance)
        self.recorder.goals.append(goal)
        if not found:
            goal.problem = Reason(Kind.NO_ACTION, self.node.action_name)
            return goal
        self._await(lambda: goal.answered)
        if not goal.answered:
            goal.problem = Reason(Kind.NO_VERDICT, self.node.action_name, seconds=_ANSWER_WITHIN_S)
        elif goal.accepted:
            # A navigation loop that sleeps by wall time would fall behind a clock that races ahead.
            self.bridge.await_feedback()
        return goal

    def get_parameter(self, name: str, node: str = "") -> evidence.ParameterAnswer:
        """Record the value of a parameter of the node, or of another: `stage.get_parameter("patrol_speed")`."""
        return self._note_parameter(name, None, None, "", node or self.plan.node)

    def set_parameter(self, name: str, value: object) -> evidence.ParameterAnswer:
        """Set a parameter of the running node: `stage.set_parameter("patrol_speed", 0.5)`.

        Whether it was accepted and its value afterwards are in `trial.parameters`.
        """
        future = self.node.parameters_of(self.plan.node).set_parameters([Parameter(name, value=value)])
        self._await(future.done)
        accepted, reason = None, f"no answer within {_ANSWER_WITHIN_S:g} s"
        if future.done() and future.result() is not None:
            results = future.result().results
            accepted = bool(results[0].successful) if results else None
            reason = str(results[0].reason)[:300] if results else "an answer without a result"
        return self._note_parameter(name, value, accepted, reason, self.plan.node)

    # -- what is recorded -----------------------------------------------------------------------------------------

    def listen(self, topic: str) -> None:
        """Record in `trial.messages` what is published on a topic from now on: `stage.listen("rosout")`.

        A topic that the contract has the node publish, or the log. It returns when the subscription is matched,
        because a trial at twelve times real time can be over before that.
        """
        read = self.readers.get(topic)

        def take(message: Any) -> None:
            found = read(message) if read else plain(message)
            if found is not None:
                set_back(found, self.bridge.began)
                self.recorder.take_message(self.t, topic, found)

        self.node.found(f"topic {topic}", lambda: self.bridge.node.count_publishers(topic) > 0)
        if topic == LOG_TOPIC:
            self.bridge.node.create_subscription(Log, topic, take, LOG_QOS)
        else:
            message_type = interface(self.contract.publishes[topic])
            self.bridge.subscribe(message_type, topic, take, raw=read is not None)
        self.bridge.await_match()

    def watch_goals(self) -> None:
        """Record from the action's status topic how all goals go, whoever sent them: `stage.watch_goals()`."""
        topic = f"{self.node.action_name}/_action/status"

        def take(message: Any) -> None:
            for status in message.status_list[:20]:
                self.recorder.take_message(self.t, topic, {"goal": _id(status.goal_info), "status": status.status})

        subscription = self.bridge.node.create_subscription(
            GoalStatusArray, topic, take, qos_profile_action_status_default
        )
        self.node.found(f"topic {topic}", lambda: subscription.get_publisher_count() > 0)
        self.bridge.await_match()

    def refresh_graph(self) -> None:
        """Record the graph once more, after a second for nodes that start late: `stage.refresh_graph()`.

        The second is wall time without waits for a CPU.
        """
        self.node.wait_until(lambda: False, 1.0)
        self.node.record_graph()

    def record_graph(self, *topics: str) -> None:
        """Record the graph once more, when it shows these topics of the node and the contract's services and action.

        `stage.record_graph("scan", "cmd_vel")`
        """
        for service, client in self.node.services.items():
            self.node.found(service, client.service_is_ready)
        if self.node.action is not None:
            self.node.found(self.node.action_name, self.node.action.server_is_ready)
        self.node.await_topics(self.plan.node, topics)
        if self.bridge.alive():
            self.node.record_graph()

    def record_graph_of(self, node: str, *topics: str) -> None:
        """Record what the graph shows of another node, when it shows these topics of it.

        `stage.record_graph_of("camera", "image")`
        """
        self.node.await_topics(node, topics)
        self._other_graph = graph.snapshot(self.bridge.node, node)

    # -- the robot's sensors and its world ------------------------------------------------------------------------

    def mute(self, *kinds: type) -> None:
        """Silence sensors, by their classes in `sim.sensors`: `stage.mute(ScanReading, ImuReading)`."""
        self.bridge.muted |= set(kinds)

    def unmute(self, *kinds: type) -> None:
        """Let sensors publish again: `stage.unmute(ScanReading)`."""
        self.bridge.unmute(*kinds)

    def distort(self, change: ChangeRanges | None) -> None:
        """Publish scans with their ranges (a numpy array, m) changed from now on; None for the true ranges.

        `stage.distort(lambda ranges: ranges + 0.1)`
        """
        self._change = change
        self.bridge.filter_scan = self._filtered

    def set_range_limits(self, range_min: float, range_max: float) -> None:
        """Publish scans that state other limits, in m, with the same ranges: `stage.set_range_limits(0.2, 5.0)`."""
        self._limits = range_min, range_max
        self.bridge.filter_scan = self._filtered

    def add_obstacle(
        self,
        distance: float,
        bearing: float = 0.0,
        radius: float = 0.15,
        *,
        name: str = "",
        towards: float = 0.0,
        speed: float = 0.0,
    ) -> str:
        """Add a round obstacle at `bearing` (rad), its surface `distance` metres from the lidar. Return its name.

        `post = stage.add_obstacle(0.5, bearing=math.pi)` puts one behind the robot. With a `speed` (m/s) it moves
        `towards` an angle (rad from the robot's heading now).
        """
        pose = self.simulator.pose
        angle, reach, way = pose.yaw + bearing, distance + radius, pose.yaw + towards
        x, y = pose.x + reach * math.cos(angle), pose.y + reach * math.sin(angle)
        aim = (x + _FAR_M * math.cos(way), y + _FAR_M * math.sin(way))
        motion = Motion((aim,), speed, starts=self.t) if speed else None
        return self.simulator.add_obstacle(Circle(center=(x, y), radius=radius, name=name, motion=motion))

    def remove_obstacle(self, name: str) -> None:
        """Remove an obstacle: `stage.remove_obstacle(post)`."""
        self.simulator.remove_obstacle(name)

    # -- processes ------------------------------------------------------------------------------------------------

    def list_launch_arguments(self) -> None:
        """Run the trial's launch file with --show-args: `stage.list_launch_arguments()`.

        The output is that of `trial.others["arguments"]`.
        """
        process = self._others["arguments"] = self._start([*LAUNCH, self._launch_file, "--show-args"])
        self.bridge.spin_until(lambda: process.exit_code() is not None, _SHOW_ARGS_WALL_S)

    def run_script(self, script: str) -> Program:
        """Start a Python script by its path in the package's source folder: `stage.run_script("scripts/demo.py")`.

        The trial needs `shows_source=True`. How it ended is in `trial.others["demo.py"]`.
        """
        process = self._start(["python3", str(source_folder(self.course) / script)])
        self._others[PurePosixPath(script).name] = process
        return process

    def interrupt(self, limit: float = 5.0) -> None:
        """Press Ctrl-C, and wait for the node to end, at most `limit` seconds: `stage.interrupt()`.

        The seconds are wall time, excluding time spent waiting for a CPU: a busy machine gives more.
        """
        self.mark("interrupt")
        self._interrupted = True
        clock = CpuClock(self.node.process, [os.getpid()])
        with dds_sockets.deaf_to_the_graph():
            self.node.process.interrupt()
            while not self.node.process.has_ended() and clock.read() < limit:
                # The clock goes on: a node that waits for its next message handles the signal only once that has come.
                self.bridge.tick_by_wall()
            if self.node.process.has_ended():
                self.measured["seconds_to_end"] = round(clock.read(), 2)
                self.bridge.spin_until(lambda: self.node.process.exit_code() is not None, _EXIT_CODE_WALL_S)
            # The node's last messages may still be on their way, above all the zero that it should end with.
            self.bridge.alive = lambda: True
            self.bridge.spin_until(lambda: False, 0.05)
            self.node.wait_until(lambda: not self.commands or self.commands[-1].is_zero, _LAST_WORD_S)
        self.bridge.alive = lambda: False

    # -- internal -------------------------------------------------------------------------------------------------

    def _tick(self, dt: float = TICK_S) -> None:
        busy = any(goal.running for goal in self.recorder.goals)
        self.node.tick(dt, ending=any(goal.may_end for goal in self.recorder.goals))
        stands = bool(self.commands) and self.commands[-1].v == self.commands[-1].omega == 0.0
        self._standing_ticks = self._standing_ticks + 1 if busy and stands else 0
        if 0 < self._standing_ticks <= _ENDING_TICKS:
            # The robot may have arrived: from the timer that stops it to the result takes some rounds.
            self.bridge.settle(_ENDING_ROUNDS)
        self.recorder.sample(self.t)
        if len(self.recorded.samples) % _CLOCK_CHECK_TICKS == 0 and self.bridge.node.count_publishers("/clock") > 1:
            self.node.foreign_publishers()
        if any(goal.silent for goal in self.recorder.goals):
            self.bridge.await_feedback()

    def _filtered(self, scan: ScanReading) -> ScanReading:
        range_min, range_max = self._limits or (scan.range_min, scan.range_max)
        ranges = scan.ranges if self._change is None else self._change(np.array(scan.ranges, dtype=float))
        return replace(scan, ranges=ranges, range_min=range_min, range_max=range_max)

    def _await(self, condition: Callable[[], bool]) -> None:
        """Wait with the clock standing still, which keeps the answer's time exact; if that fails, let time pass."""
        if self.bridge.pace == "lockstep" and self.bridge.spin_until(condition, ANSWER_WALL_S):
            return
        self.run_until(condition, _ANSWER_WITHIN_S)

    def _note_parameter(
        self, name: str, wanted: object, accepted: bool | None, reason: str, node: str
    ) -> evidence.ParameterAnswer:
        future = self.node.parameters_of(node).get_parameters([name])
        self._await(future.done)
        value = None
        if future.done() and future.result() is not None and future.result().values:
            try:
                value = parameter_value_to_python(future.result().values[0])
                if value is not None:  # a byte array, or ten million numbers, are kept as far as they fit
                    value = plain(list(value) if isinstance(value, tuple) else value)
            except Exception as error:  # a node may answer anything; nothing of it is an error of ours
                reason = reason or f"an answer that is not a parameter's value: {error}"[:300]
        self.recorded.parameters.append(evidence.ParameterAnswer(self.t, name, wanted, accepted, value, reason, node))
        return self.recorded.parameters[-1]


def _id(goal: Any) -> str:
    return bytes(goal.goal_id.uuid).hex()


def _end(process: Program, by: str = "itself", said_before: int = 0) -> evidence.ProcessEnd:
    code = process.exit_code()
    by = "us" if code is None else by
    said = tracebacks.tail(process.output[said_before:], 4000)
    return evidence.ProcessEnd(by, code, round(process.wall_seconds, 2), said)
