"""The ROS side of the simulator: topics, /clock, and lockstep with a node. The only rclpy in sim.

The simulator owns the time. A tick publishes the sensors and the clock and ends as soon as the node has answered, so a
run takes as long as the node computes, whatever the simulated time. How the bridge recognises an answer:

1. Every rclpy node has parameter services. Executors serve them last, after subscriptions and timers, one call per
   round. So the second of two calls (`_barrier`) returns only when the callbacks of this tick are done, and the timers
   that they made due.
2. A node with several threads may answer the calls while a timer's callback is still running in another thread. The
   bridge learns the period in which the node publishes, and waits for a message that is due.
3. /clock is best effort with depth one on the node's side, so it can get lost: it is sent again if no answer comes.
4. Wall-clock limits keep a dead or blocked node from holding up the run.

A node that runs on wall time publishes while the clock stands still. A node that answers too rarely, or has just been
given a goal, is run in real time for a moment (`Probe`), and from then on if it sends messages after a tick is over.

Anything that another run may not repeat is recorded in `simulator.unrepeatable`, and so in its recording. A message
that arrives after the node has said that it is done, with nothing new sent to it, shows that its timing depends on
other threads or on another clock than ours.
"""

from __future__ import annotations

import math
import time
import warnings
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import rclpy
from geometry_msgs.msg import Twist as TwistMessage
from geometry_msgs.msg import TwistStamped
from nav_msgs.msg import Odometry
from rcl_interfaces.srv import GetParameterTypes
from rclpy.client import Client
from rclpy.context import Context
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile, QoSReliabilityPolicy
from rclpy.task import Future
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import BatteryState, Imu, LaserScan

from sim.messages import START_S, no_float, set_stamp, to_message
from sim.pace import Answers, Probe, Repeatability
from sim.sensors import BatteryReading, ImuReading, OdometryReading, Reading, ScanReading
from sim.simulator import Simulator

__all__ = ["CONTROLLER", "NODE_NAME", "START_S", "TICK_S", "Bridge", "Topics", "to_message"]

NODE_NAME = "simulated_robot"
"""The same in a notebook and in a grading, so that a node cannot tell who is watching."""

TICK_S = 0.05  # 20 Hz: the odometry's rate, and twice the control loop's

# Of the node's executor per tick: one for its messages, one for its timers. A wait set looks for messages first and for
# calls then: a call that comes between the two is served a round before the clock message that was sent before it.
_ROUNDS = 2
_BARRIER_CAP_S = 5.0  # of wall time, for a live node: long, so that a busy machine makes no difference
_BLOCKED_CAP_S = 0.1  # the same, after it has left one unanswered
_DUE_CAP_S = 0.3  # for a message that is due
_CATCH_UP_CAP_S = 0.5  # for messages that have already arrived
_GENERATIONS = 3  # of our executor's queue: an action's message, the task that serves it, its future's callbacks
_RESENT_AFTER_S = 0.05  # without an answer: the clock message is sent again, it may have been lost
_SILENCES_ALLOWED = 3  # how often a run probes a node that answers too rarely
_UNEVEN = (0.6, 1.4, 1.0)  # lengths of a probe's ticks: uneven, so that a 20 Hz wall-time loop falls out of step
_PROMPT_S = 0.01  # of wall time after a barrier: the tick did not cause messages that arrive later
_LOOK_S = 0.05  # of waiting for the node, after which we look whether it lives
_AS_PUBLISHED = QoSProfile(depth=10, reliability=QoSReliabilityPolicy.BEST_AVAILABLE)
_SENSOR_TYPES = frozenset({ScanReading, OdometryReading, ImuReading, BatteryReading})
_wall_s = time.monotonic  # Bridge has a `time` of its own
_QUIET_S = 0.5  # a node has come up when the graph has not changed for so long after its first answer
_STABLE_S = 4.0  # the same for a node that does not answer: it may be busy in its constructor
_ASKED_AGAIN_TICKS = 20  # in real time, where no tick waits for an answer, the node is asked once a second


@dataclass(frozen=True)
class Topics:
    """The node's topic names for the robot's sensors and command; "" for a sensor that it does not get."""

    scan: str = ""
    odom: str = ""
    imu: str = ""
    battery: str = ""
    command: str = ""
    answer: str = ""
    """The topic whose messages show that the node has finished its work for a tick."""
    answer_s: float = TICK_S
    """The default period of the answers, s."""


CONTROLLER = Topics(scan="scan", odom="odom", command="cmd_vel", answer="cmd_vel", answer_s=0.1)
"""The topics of a mobile robot by ROS's usual names, for a node that drives it with ten commands a second."""


class Bridge:
    """A simulated robot on a ROS graph.

    Args:
        simulator: the robot; only the bridge may step it.
        topics: the node's topic names.
        node_name: the node to stay in lockstep with.
        domain_id: the DDS domain; processes in other domains receive nothing.
        alive: returns whether the node's process is running, so that the bridge does not wait for a dead node.
        namespace: the node's, "" for the root namespace.
        reliable: whether the sensors are published reliably or, as many drivers do, best effort.
        stamped: whether the robot takes TwistStamped commands, as a TurtleBot 4 on Jazzy does.
    """

    def __init__(
        self,
        simulator: Simulator,
        topics: Topics,
        node_name: str,
        *,
        domain_id: int,
        alive: Callable[[], bool] = lambda: True,
        reliable: bool = True,
        namespace: str = "",
        stamped: bool = False,
    ) -> None:
        self.simulator = simulator
        self.began = 0.0
        self.topics = topics
        self.node_name = node_name
        self._namespace = namespace
        self._told: set[str] = set()
        self.alive = alive
        self.pace = "lockstep"
        self.blocked = False
        """Whether the node has left a barrier unanswered: it is busy in a callback, or gone."""
        self._repeatability = Repeatability()
        self.filter_scan: Callable[[ScanReading], ScanReading | None] = lambda scan: scan
        self.on_command: Callable[[float, TwistMessage], None] = lambda _t, _message: None
        self.on_published: Callable[[Reading], None] = lambda _reading: None
        self.muted: set[type] = set()
        """The types of readings that are not published; `unmute` takes some out."""

        self._context = Context()
        rclpy.init(context=self._context, domain_id=domain_id)
        # Without parameter services, with which a node under trial could set our use_sim_time or keep us busy.
        self.node: Node = rclpy.create_node(
            NODE_NAME, context=self._context, enable_rosout=False, start_parameter_services=False
        )
        # Several times faster than the default executor, which rebuilds its wait set each time.
        self._executor = EventsExecutor(context=self._context)
        self._executor.add_node(self.node)
        self._answers = Answers()
        self._tick = 0
        self._wall_due = 0.0
        self._feedback = 0
        self._probe: Probe | None = None
        self._silences = 0
        self._awaited = 0  # the tick from which answers are awaited
        self._idle = False  # whether the node has said that it is done, and nothing has been sent to it since
        self._make_publishers(reliable)
        self._barrier_client = self._client()
        self._asked: Future | None = None
        self.heard = 0
        """The number of signs of life so far: messages of the node's and answers to calls."""
        self.served = 0
        """The number of answers to calls so far, which only a node gives whose executor is free."""
        if topics.command and stamped:
            self.subscribe(TwistStamped, topics.command, self._take_stamped)
        elif topics.command:
            self.subscribe(TwistMessage, topics.command, self._take_command)

    # -- life -----------------------------------------------------------------------------------------------------

    def close(self) -> None:
        """Leave the graph."""
        self._executor.shutdown()
        self.node.destroy_node()
        self._context.try_shutdown()

    def watch_answers(self, message_type: type) -> None:
        """Count messages of the answer topic as answers (the command topic is watched anyway)."""
        self.subscribe(message_type, self.topics.answer, lambda _: self._note_answer())

    def subscribe(self, message_type: Any, topic: str, take: Callable[[Any], None], *, raw: bool = False) -> None:
        """Subscribe reliably, or best effort if somebody publishes the topic so, who would not be heard otherwise.

        What is subscribed to before the node has come up is decided when it has: `await_node`. `raw` hands over bytes.
        """
        self.node.create_subscription(message_type, topic, take, _AS_PUBLISHED, raw=raw)

    def _subscribe_again(self) -> None:
        """Subscribe anew to what is published best effort: a subscription keeps the quality that it began with."""
        for old in list(self.node.subscriptions):
            published = self.node.get_publishers_info_by_topic(old.topic_name)
            if any(each.qos_profile.reliability == QoSReliabilityPolicy.BEST_EFFORT for each in published):
                self.subscribe(old.msg_type, old.topic_name, old.callback, raw=old.raw)
                self.node.destroy_subscription(old)

    @property
    def time(self) -> float:
        """The simulated time since the start, in s. /clock is ahead of it by START_S, and by `began`."""
        return self.simulator.time

    def unmute(self, *kinds: type) -> None:
        """Publish these readings again. How a node keeps time that had nothing to say before is probed once more."""
        self.muted -= set(kinds)
        self._silences, self._awaited = 0, self._tick

    def go_on(self, simulator: Simulator) -> None:
        """Go on with another simulator. To the node it is the same robot if its pose is what odometry has said last.

        The clock does not go back: `time` begins at 0 again, and `began` is when that was.
        """
        self.began += self.simulator.time
        self.simulator = simulator
        self.filter_scan = lambda scan: scan
        self.muted = set()

    def await_node(
        self,
        expected: Callable[[], bool],
        wall_seconds: float = 20.0,
        quiet_s: float = _QUIET_S,
        clock: Callable[[], float] = _wall_s,
    ) -> bool:
        """Wait until the node has come up, then start the clock. Return whether it is on the graph.

        It is up when `expected` holds or, failing that, when it has answered a call of its parameter services, which
        it does once it spins, and the graph has then not changed for `quiet_s`. A node that never answers gets longer.
        The seconds are measured by `clock`, which may leave out the time that a busy machine gave to other processes.
        """
        deadline = clock() + wall_seconds
        seen: object = None
        since = clock()
        asked: Future | None = None
        while clock() < deadline and self.alive():
            if asked is None and self._barrier_client.service_is_ready():
                asked = self._barrier_client.call_async(GetParameterTypes.Request())
            if self._visible() and self._matched() and expected():
                break
            now = clock()
            spins = asked is not None and asked.done()
            view = (spins, self._view())
            if view != seen:
                seen, since = view, now
            elif self._visible() and now - since > (quiet_s if spins else _STABLE_S):
                break
            self._executor.spin_once(timeout_sec=0.01)
        if not self._visible():
            return False
        self._subscribe_again()
        # Before the clock starts, or the node's first message could come too soon to be heard; but a node may wait for
        # the clock before it spins.
        until = clock() + _QUIET_S
        while asked is not None and not asked.done() and clock() < until and self.alive():
            self._executor.spin_once(timeout_sec=0.01)
        hears_us = asked is not None and asked.done() and self.await_match()
        self._publish_clock()
        if hears_us or self.await_match():
            self._barrier()
            self._publish_clock()  # once more: it can get lost, and no answer is known yet to be due
            self._barrier()
        return True

    def await_match(self) -> bool:
        """Wait until the node has discovered everything that the bridge's node has created so far.

        What it publishes before that is lost. DDS announces endpoints in the order of their creation, and a server
        answers a client only once it has discovered it; so the answer to a client that is created now is the proof.
        Return False if the node does not answer.
        """
        if not self._barrier_client.service_is_ready():
            return False
        client = self._client()
        try:
            limit = _BLOCKED_CAP_S if self.blocked else _BARRIER_CAP_S
            if not self.spin_until(client.service_is_ready, limit):
                return False
            self.blocked = not self.spin_until(client.call_async(GetParameterTypes.Request()).done, limit)
        finally:
            self.node.destroy_client(client)
        self._count_served(not self.blocked)
        return not self.blocked

    def drain(self) -> None:
        """Wait until what the node has published so far has arrived, whatever its pace."""
        if self.alive():
            self._barrier()

    # -- time -----------------------------------------------------------------------------------------------------

    def tick(self, dt: float = TICK_S, further_rounds: int = 0) -> None:
        """Advance the simulation by `dt` seconds and wait for the node to answer and to finish `further_rounds`."""
        if self.pace == "real time":
            self.tick_by_wall(dt)
            self._repeatability.real_time = True
        elif self._probe is not None:
            before, began = self._signs(), _wall_s()
            self._advance(dt)
            # Do not wait for an answer that is due: one on wall time would arrive meanwhile and seem to be in step.
            self._barrier(_ROUNDS + further_rounds)
            self._watch(self._probe, before, began, dt)
        else:
            self._advance(dt)
            self._await_answer(_ROUNDS + further_rounds)
            if self._suspiciously_silent(dt):
                self._silences += 1
                self._probe = Probe(expects_feedback=False)
        self.simulator.unrepeatable = self._repeatability.caveat()

    def tick_by_wall(self, dt: float = TICK_S) -> None:
        """Advance the simulation by `dt` seconds and let the same wall time pass, whether or not the node answers."""
        self._advance(dt)
        if self._tick % _ASKED_AGAIN_TICKS == 0:
            self._ask()
        self._wait_for_wall(dt)

    @property
    def can_ask(self) -> bool:
        """Return whether the node has the services by which it is asked whether it is done."""
        return bool(self._barrier_client.service_is_ready())

    @property
    def answers(self) -> int:
        """The number of answers so far."""
        return self._answers.count

    def await_feedback(self) -> None:
        """Probe in the next ticks whether a goal's feedback, or the commands, come on wall time."""
        if self.pace == "lockstep" and self._probe is None:
            self._probe = Probe(expects_feedback=True)

    def note_feedback(self) -> None:
        """Count a feedback message; like an answer, it is a sign of life."""
        self._feedback += 1
        self.heard += 1

    def spin_until(self, condition: Callable[[], bool], wall_seconds: float) -> bool:
        """Serve callbacks while the clock stands still, until `condition` holds. Return whether it does."""
        self._idle = False  # the caller has sent a request
        return self._serve(condition, wall_seconds)

    def _serve(self, condition: Callable[[], bool], wall_seconds: float) -> bool:
        began = time.monotonic()
        deadline, look = began + wall_seconds, began + _LOOK_S
        while not condition():
            now = time.monotonic()
            if now >= deadline or (now >= look and not self.alive()):
                return condition()
            self._executor.spin_once(timeout_sec=min(deadline - now, _LOOK_S))
        return True

    def settle(self, rounds: int = _ROUNDS) -> None:
        """Let the node process what it has received, and send its results, while the clock stands still."""
        if self.pace == "lockstep":
            self._barrier(rounds)

    def _suspiciously_silent(self, dt: float) -> bool:
        # A node that has not answered yet may have to wait for its first scan.
        allowed = _SILENCES_ALLOWED if self._answers.count else 1
        silent = (self._tick - max(self._answers.last or 0, self._awaited)) * dt
        return silent > self.topics.answer_s + 1e-9 and self._silences < allowed

    def _watch(self, probe: Probe, before: tuple[int, int], began: float, dt: float) -> None:
        """Let wall time pass after a tick that `began` then, and count the messages that the tick did not cause."""
        self._listen(lambda: False, _PROMPT_S)
        answers, feedback = self._signs()
        waited = _wall_s()
        probe.prompt_s += waited - began
        probe.prompt += feedback > before[1] if probe.expects_feedback else answers > before[0]
        # From now, not from the start of the tick: on a busy machine all of that is over when the barrier returns.
        self._listen(lambda: False, _UNEVEN[probe.ticks % len(_UNEVEN)] * dt)
        probe.late += sum(self._signs()) - answers - feedback
        probe.late_s += _wall_s() - waited
        probe.ticks += 1
        if verdict := probe.verdict():
            self.pace, self._probe = verdict, None
            self._repeatability.without_feedback = probe.silent

    def _signs(self) -> tuple[int, int]:
        return self._answers.count, self._feedback

    def _advance(self, dt: float) -> None:
        self._tick += 1
        without = (_SENSOR_TYPES - self._sensors.keys()) | self.muted
        readings = [reading for each in self.simulator.step(dt, without) if (reading := self._filtered(each))]
        if self._idle:
            self._listen(self._caught_up(), _CATCH_UP_CAP_S)
            self._idle = False
        messages = [(self._sensors[type(reading)], to_message(reading, self.began)) for reading in readings]
        # All together, because each message that arrives alone costs the node a round of its executor.
        for publisher, message in messages:
            publisher.publish(message)
        most = max(Counter(type(reading) for reading in readings).values(), default=0)
        if most > 1 and self.pace == "lockstep":
            # A round takes one message of each topic. All of them must arrive before the clock does, otherwise it would
            # depend on timing which IMU reading is the latest when a timer fires.
            self._barrier(most)
        self._publish_clock()

    def _await_answer(self, rounds: int) -> None:
        if not self._barrier(rounds) and not self.alive():
            return
        self._repeatability.unanswered += self.blocked
        if not self._answers.due(self._tick) or self._answered():
            return
        if not self._listen(self._answered, _RESENT_AFTER_S):
            self._publish_clock()
            self._barrier()
            if not self._listen(self._answered, _DUE_CAP_S):
                self._answers.missed()
                return
        self._barrier()  # for what else the node has published with its answer

    def _answered(self) -> bool:
        return self._answers.last == self._tick

    def _barrier(self, rounds: int = _ROUNDS) -> bool:
        """Wait until the node has served `rounds` calls, each after its subscriptions and timers.

        Return whether it has.
        """
        self._idle = False
        if not self._barrier_client.service_is_ready():
            self._repeatability.without_services += self.alive()
            self._serve(lambda: False, 0.002)
            return False
        calls = [self._barrier_client.call_async(GetParameterTypes.Request()) for _ in range(rounds)]
        if not self._serve(calls[-1].done, _BLOCKED_CAP_S if self.blocked else _BARRIER_CAP_S):
            for call in calls:
                self._barrier_client.remove_pending_request(call)
            self.blocked = True
            return False
        self.blocked = False
        self._count_served()
        self._serve(self._caught_up(), _CATCH_UP_CAP_S)
        self._idle = True
        return True

    def _ask(self) -> None:
        """Call the node without waiting: its answer is a sign of life."""
        if self.can_ask and (self._asked is None or self._asked.done()):
            self._asked = self._barrier_client.call_async(GetParameterTypes.Request())
            self._asked.add_done_callback(self._note_life)

    def _note_life(self, _answered: Future) -> None:
        self._count_served()

    def _count_served(self, count: int = 1) -> None:
        self.heard += count
        self.served += count

    def _note_answer(self) -> None:
        self._answers.note(self._tick)
        self.heard += 1

    def _caught_up(self) -> Callable[[], bool]:
        """Return a condition: whether everything that had arrived by now has been served, down to its last callback."""
        served = Future()

        def queue_up(generations: int) -> None:
            # Always behind everything that is queued by now: the next generation is what that has put there.
            if generations:
                self._executor.create_task(queue_up, generations - 1)
            else:
                served.set_result(None)

        queue_up(_GENERATIONS)
        return served.done

    def _listen(self, condition: Callable[[], bool], wall_seconds: float) -> bool:
        """Serve callbacks until `condition` holds; count the answers of an idle node as unprompted."""
        before = self._answers.count
        met = self._serve(condition, wall_seconds)
        if self._idle:
            self._repeatability.unprompted += self._answers.count - before
        return met

    def _wait_for_wall(self, dt: float) -> None:
        # Do not catch up after a pause (a service call, a slow start): the node would run faster than real time.
        self._wall_due = max(self._wall_due + dt, time.monotonic() - dt)
        self._serve(lambda: time.monotonic() >= self._wall_due, dt + 0.05)
        # What has arrived is what the node has said in this tick, even if we are late ourselves.
        self._serve(self._caught_up(), _CATCH_UP_CAP_S)

    # -- topics ---------------------------------------------------------------------------------------------------

    def _client(self) -> Client:
        return self.node.create_client(
            GetParameterTypes, f"{self._namespace}/{self.node_name}/get_parameter_types".lstrip("/")
        )

    def _make_publishers(self, reliable: bool) -> None:
        policy = QoSReliabilityPolicy.RELIABLE if reliable else QoSReliabilityPolicy.BEST_EFFORT
        qos = QoSProfile(depth=10, reliability=policy)
        self._clock = self.node.create_publisher(Clock, "/clock", 10)
        self._clock_message = Clock()
        self._sensors: dict[type, Publisher] = {}
        for reading, message, topic in (
            (ScanReading, LaserScan, self.topics.scan),
            (OdometryReading, Odometry, self.topics.odom),
            (ImuReading, Imu, self.topics.imu),
            (BatteryReading, BatteryState, self.topics.battery),
        ):
            if topic:
                self._sensors[reading] = self.node.create_publisher(message, topic, qos)

    def _filtered(self, reading: Reading) -> Reading | None:
        """Return the reading as the node gets it, None if it does not get it."""
        passed = self.filter_scan(reading) if isinstance(reading, ScanReading) else reading
        if passed is not None:
            self.on_published(passed)
        return passed

    def _publish_clock(self) -> None:
        self._idle = False
        set_stamp(self._clock_message.clock, self.began + self.simulator.time)
        self._clock.publish(self._clock_message)

    def _take_stamped(self, message: TwistStamped) -> None:
        self._take_command(message.twist)

    def _take_command(self, message: TwistMessage) -> None:
        self.heard += 1
        if self.topics.answer == self.topics.command:
            self._answers.note(self._tick)
        self.on_command(self.simulator.time, message)
        v, omega = message.linear.x, message.angular.z
        for field, value in (("linear.x", v), ("angular.z", omega)):
            if (said := no_float(value)) and field not in self._told:
                self._told.add(field)
                warnings.warn(f"{self.topics.command}: {field} is {said}", RuntimeWarning, stacklevel=1)
        if math.isfinite(v) and math.isfinite(omega):
            self.simulator.command(v, omega)

    # -- graph ----------------------------------------------------------------------------------------------------

    def _visible(self) -> bool:
        return self.node_name in self.node.get_node_names()

    def _matched(self) -> bool:
        return all(publisher.get_subscription_count() > 0 for publisher in self._sensors.values()) and (
            not self.topics.answer or self.node.count_publishers(self.topics.answer) > 0
        )

    def _view(self) -> tuple[object, ...]:
        names = tuple(sorted(self.node.get_node_names()))
        if self.node_name not in names:
            return names
        own = (self.node_name, f"/{self._namespace}")
        try:
            return (
                names,
                str(self.node.get_publisher_names_and_types_by_node(*own)),
                str(self.node.get_subscriber_names_and_types_by_node(*own)),
                str(self.node.get_service_names_and_types_by_node(*own)),
            )
        except RuntimeError:  # the node left between the two calls
            return names
