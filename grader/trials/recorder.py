"""The facts of a trial while it runs: what the robot did, what the node published, what it answered."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from grader import evidence
from grader.evidence import Reason
from grader.trials.goal import SentGoal
from grader.trials.plan import TrialPlan
from grader.trials.request import not_started
from sim.bridge import Topics
from sim.sensors import BatteryReading, ImuReading, Reading, ScanReading
from sim.simulator import Simulator

# Of each kind of message. An honest trial has a thousand at most; a node that floods us must not fill our memory.
_MAX_KEPT = 20_000


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
