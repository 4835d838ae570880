"""The facts of a trial while it runs: what the robot did, what the node published and answered, how goals go."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
from action_msgs.msg import GoalStatus

from grader import evidence
from grader.course import GoalFields
from grader.evidence import Reason
from grader.trials.messages import fill
from grader.trials.node_under_test import NodeUnderTest
from grader.trials.plan import TrialPlan
from grader.trials.request import not_started
from sim.bridge import Topics
from sim.sensors import BatteryReading, ImuReading, Reading, ScanReading
from sim.simulator import Simulator

# Of each kind of message. An honest trial has a thousand at most; a node that floods us must not fill our memory.
_MAX_KEPT = 20_000
_STATUS = {
    GoalStatus.STATUS_SUCCEEDED: "succeeded",
    GoalStatus.STATUS_CANCELED: "canceled",
    GoalStatus.STATUS_ABORTED: "aborted",
}
ANSWER_WALL_S = 3.0  # how long the clock stands still for an answer before time goes on
_SILENT_S = 0.6
_NEW_S = 0.5
_NEAR_M = 0.2  # beyond the tolerance, for what odometry may be off and a robot drives in some ticks
_FEEDBACK_KEPT = 20_000  # a flood must not fill our memory


class SentGoal:
    """A goal that was sent: its progress and, in the end, its facts. Position in the odom frame, in metres."""

    def __init__(self, node: NodeUnderTest, fields: GoalFields, x: float, y: float, tolerance: float) -> None:
        self._node, self._fields = node, fields
        self._sent_t = node.bridge.time
        self._x, self._y, self._tolerance = x, y, tolerance
        self._feedback: list[list[float]] = []
        self._ended_t = math.nan
        self._cancel_t = math.nan
        self._cancel: Any = None
        self._handle: Any = None
        self._result: Any = None
        self.problem: evidence.Reason | None = None
        pose = {"position": {"x": float(x), "y": float(y)}, "orientation": {"w": 1.0}}
        goal = fill(node.action_type.Goal(), {fields.target: pose, fields.tolerance: float(tolerance)})
        sending = node.action.send_goal_async(goal, feedback_callback=self._take_feedback)
        sending.add_done_callback(self._take_answer)

    @property
    def answered(self) -> bool:
        """Return whether the node has accepted or rejected the goal."""
        return self._handle is not None

    @property
    def accepted(self) -> bool:
        """Return whether the node has accepted the goal."""
        return self._handle is not None and bool(self._handle.accepted)

    @property
    def ended(self) -> bool:
        """Return whether the result has come, or never will because the goal was rejected."""
        return self._result is not None or (self.answered and not self.accepted)

    @property
    def running(self) -> bool:
        """Return whether the node is working on the goal."""
        return self.accepted and not self.ended

    @property
    def may_end(self) -> bool:
        """Return whether the node may end the goal in this tick: it has just come, is cancelled, or nearly reached."""
        bridge = self._node.bridge
        left = math.hypot(self._x - bridge.simulator.pose.x, self._y - bridge.simulator.pose.y)
        is_new = bridge.time - self._sent_t < _NEW_S
        return self.running and (is_new or math.isfinite(self._cancel_t) or left < self._tolerance + _NEAR_M)

    @property
    def silent(self) -> bool:
        """Return whether feedback is overdue: the contract asks for some every half second."""
        last = self._feedback[-1][0] if self._feedback else self._sent_t
        return self.running and self._node.bridge.time - last > _SILENT_S

    @property
    def result(self) -> Any:
        """Return the result message, None until it has come."""
        return None if self._result is None else self._result.result

    def cancel(self) -> None:
        """Ask the node to cancel the goal; in lockstep, with the clock standing still until it answers.

        Else it would be chance whether the request reaches the node before or after the next tick.
        """
        self._cancel_t = self._node.bridge.time
        if self.accepted:
            self._cancel = self._handle.cancel_goal_async()
            if self._node.bridge.pace == "lockstep":
                self._node.bridge.spin_until(self._cancel.done, ANSWER_WALL_S)

    def facts(self) -> evidence.Goal:
        """Return what has become of the goal so far."""
        result = self.result
        place = None if result is None else getattr(result, self._fields.final).position
        status = "unfinished" if result is None else _STATUS.get(self._result.status, "unfinished")
        if self.answered and not self.accepted:
            status = "rejected"
        cancel_done = self._cancel is not None and self._cancel.done()
        return evidence.Goal(
            t=self._sent_t,
            x=self._x,
            y=self._y,
            tolerance=self._tolerance,
            accepted=self.accepted,
            status=status,
            success=None if result is None else bool(getattr(result, self._fields.success)),
            final_x=math.nan if place is None else float(place.x),
            final_y=math.nan if place is None else float(place.y),
            ended_t=self._ended_t,
            cancel_t=self._cancel_t,
            cancel_accepted=bool(self._cancel.result().goals_canceling) if cancel_done else None,
            feedback=self._feedback,
            problem=self.problem,
        )

    def _take_answer(self, future: Any) -> None:
        self._handle = future.result()
        if self._handle.accepted:
            self._handle.get_result_async().add_done_callback(self._take_result)

    def _take_result(self, future: Any) -> None:
        self._result = future.result()
        self._ended_t = self._node.bridge.time

    def _take_feedback(self, message: Any) -> None:
        pose = self._node.bridge.simulator.pose
        true_distance = math.hypot(self._x - pose.x, self._y - pose.y)
        self._node.bridge.note_feedback()
        if len(self._feedback) < _FEEDBACK_KEPT:
            said = float(getattr(message.feedback, self._fields.remaining))
            self._feedback.append([self._node.bridge.time, said, true_distance])


class TrialRecorder:
    """Collects a trial's facts. Times are simulated seconds since the trial began."""

    def __init__(self, plan: TrialPlan, simulator: Simulator, topics: Topics, ahead_deg: float) -> None:
        """Record a node that receives the robot's `topics`, and for which `ahead` goes so far to either side."""
        self.simulator = simulator
        self.facts = not_started(plan, simulator.seed)
        """The lists and dictionaries in it fill as the trial goes; `complete` adds the rest."""
        self.goals: list[SentGoal] = []
        self.dropped = 0
        self._topics = topics
        self._ahead = math.cos(math.radians(ahead_deg))

    def complete(self, **rest: Any) -> evidence.Trial:
        """Return all facts; `rest` are fields of the trial that are known only in the end."""
        return replace(
            self.facts,
            touches=[
                evidence.Touch(contact.time, contact.obstacle, contact.speed) for contact in self.simulator.contacts
            ],
            goals=[goal.facts() for goal in self.goals],
            scene=self._scene(),
            dropped=self.dropped,
            **rest,
        )

    def sample(self, t: float) -> None:
        """Record where the robot is at time `t`."""
        pose, twist, odometry = self.simulator.pose, self.simulator.twist, self.simulator.odometry().pose
        self.facts.samples.append(
            evidence.Sample(
                t, pose.x, pose.y, pose.yaw, twist.v, twist.omega, odometry.x, odometry.y, odometry.yaw,
                self.simulator.clearance(),
            )
        )  # fmt: skip

    def take_command(self, t: float, message: Any) -> None:
        """Record a command of the node's."""
        if not self.may_keep(self.facts.commands):
            return
        others = (message.linear.y, message.linear.z, message.angular.x, message.angular.y)
        other = max((abs(value) for value in others), default=0.0)
        self.facts.commands.append(evidence.Command(t, message.linear.x, message.angular.z, other))

    def take_published(self, reading: Reading) -> None:
        """Record what a sensor of the robot publishes: of a scan the closest distances."""
        if isinstance(reading, ScanReading):
            self.facts.scans.append(_summary(reading, self._ahead))
        elif isinstance(reading, ImuReading) and self._topics.imu:
            data = {
                "linear_acceleration": [float(value) for value in reading.linear_acceleration],
                "angular_velocity": [float(value) for value in reading.angular_velocity],
            }
            self.facts.published.append(evidence.Message(reading.stamp, self._topics.imu, data))
        elif isinstance(reading, BatteryReading):
            percent = {"percentage": float(reading.percentage)}
            self.facts.published.append(evidence.Message(reading.stamp, self._topics.battery, percent))

    def note_call(
        self,
        asked: float,
        service: str,
        request: dict[str, object],
        response: Any,
        problem: Reason | None = None,
    ) -> evidence.Call:
        """Record a call and its response, None with the `problem` if there was none."""
        self.facts.calls.append(evidence.Call(asked, service, dict(request), response, problem))
        return self.facts.calls[-1]

    def take_message(self, t: float, topic: str, data: dict[str, Any]) -> None:
        """Record a message on a topic that a script listens to."""
        if self.may_keep(self.facts.messages):
            self.facts.messages.append(evidence.Message(t, topic, data))

    def may_keep(self, kept: list[Any]) -> bool:
        """Return whether one more message may be kept; count it as dropped if not."""
        full = len(kept) >= _MAX_KEPT
        self.dropped += full
        return not full

    def _scene(self) -> dict[str, Any]:
        found = {
            # When it was removed, so that a picture can draw it as temporary.
            p.obstacle.name: replace(p.obstacle, vanishes=round(p.until, 3)) if math.isfinite(p.until) else p.obstacle
            for p in self.simulator.presences
        }
        return replace(self.simulator.world, obstacles=tuple(found.values())).to_dict()


def _summary(scan: ScanReading, least: float) -> evidence.ScanSummary:
    ranges = np.asarray(scan.ranges, dtype=float)
    angles = scan.angle_min + scan.angle_increment * np.arange(len(ranges))
    ahead = np.cos(angles) >= least - 1e-9
    behind = np.cos(angles) <= 1e-9 - least
    valid = np.isfinite(ranges) & (ranges >= scan.range_min) & (ranges <= scan.range_max)

    def closest(where: np.ndarray[Any, Any]) -> float:
        found = ranges[valid & where]
        return float(found.min()) if found.size else math.inf

    return evidence.ScanSummary(scan.stamp, closest(ahead), closest(behind), closest(np.ones_like(valid)))
