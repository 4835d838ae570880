"""Drive a simulated robot with a function, without ROS, and record it. And a simple driver to begin with."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from sim.geometry import Point, Pose, Twist
from sim.planner import plan
from sim.recording import Recorder, Recording
from sim.sensors import OdometryReading, Reading, ScanReading
from sim.simulator import Simulator


@dataclass(frozen=True)
class Seen:
    """What a driver knows: the time in s and the latest scan and odometry."""

    time: float
    scan: ScanReading
    odometry: OdometryReading


Driver = Callable[[Seen], Twist]


def drive(
    simulator: Simulator,
    driver: Driver,
    duration: float,
    period: float = 0.1,
    scan_every: int = 1,
    until: Callable[[], bool] = lambda: False,
) -> Recording:
    """Let the driver command the robot every `period` s for `duration` s of simulated time; return the recording.

    It ends earlier when `until()` is true.
    """
    recorder = Recorder(simulator, scan_every=scan_every)
    seen = Seen(simulator.time, simulator.scan(), simulator.odometry())
    end = simulator.time + duration
    sample = min(0.05, period)
    while simulator.time < end - 1e-9 and not until():
        command = driver(seen)
        simulator.command(command.v, command.omega)
        for _ in range(round(period / sample)):
            readings = simulator.step(sample)
            recorder.take(readings)
            seen = _updated(seen, simulator.time, readings)
    return recorder.recording()


def _updated(seen: Seen, time: float, readings: list[Reading]) -> Seen:
    for reading in readings:
        if isinstance(reading, ScanReading):
            seen = replace(seen, scan=reading)
        elif isinstance(reading, OdometryReading):
            seen = replace(seen, odometry=reading)
    return replace(seen, time=time)


class Tourist:
    """Drives to a world's goals, one after the other, along a way planned on the map; stands while it is blocked.

    Without goals it goes straight ahead and turns away from what comes near. A robot to look at, not a model solution:
    it knows the map.
    """

    CRUISE = 0.4  # m/s
    ARRIVED = 0.06  # m
    LANE = 0.19  # m to each side: the hull and 2 cm
    STOP = 0.45  # m ahead, from the robot's centre

    def __init__(self, simulator: Simulator) -> None:
        self._simulator = simulator
        self._to_odom = simulator.odom_origin.inverse()
        self._lidar = simulator.profile.lidar.pose
        self._goals = [(goal.x, goal.y) for goal in simulator.world.goals]
        self._endless = not self._goals
        self._way: list[Point] = []

    def __call__(self, seen: Seen) -> Twist:
        """Return the command for what is seen."""
        ahead = self._free_ahead(seen.scan)
        if self._endless:
            return Twist(0.0, 0.8) if ahead < 0.7 else Twist(self.CRUISE, 0.0)
        target = self._next_target(seen.odometry.pose)
        if target is None:
            return Twist()
        pose = seen.odometry.pose
        x, y = pose.point_from_parent(target)
        bearing, distance = math.atan2(y, x), math.hypot(x, y)
        slow = 0.05 + distance if len(self._way) == 1 else self.CRUISE
        v = min(self.CRUISE, slow) * max(0.0, 1.0 - abs(bearing) / 0.8)
        if v > 0.0 and ahead < min(self.STOP, distance + self.LANE):
            v = 0.0  # somebody is in the way
        return Twist(v, max(-1.5, min(1.5, 2.5 * bearing)))

    def has_arrived(self) -> bool:
        """Tell whether all goals have been reached and the robot stands."""
        return not (self._endless or self._goals or self._way) and self._simulator.twist == Twist()

    def _next_target(self, pose: Pose) -> Point | None:
        """Return the next point of the way in the odometry frame; plan a new one when a goal is reached."""
        while True:
            while self._way:
                target = self._to_odom.point_to_parent(self._way[0])
                if math.hypot(target[0] - pose.x, target[1] - pose.y) > self.ARRIVED:
                    return target
                self._way.pop(0)
            if not self._goals:
                return None
            here = self._simulator.odom_origin.point_to_parent((pose.x, pose.y))
            self._way = plan(self._simulator.world, here, self._goals.pop(0), self.LANE + 0.08)

    def _free_ahead(self, scan: ScanReading) -> float:
        """Return how far ahead the first thing in the lane is, in m from the robot's centre."""
        valid = np.isfinite(scan.ranges)
        angles = scan.angles[valid] + self._lidar.yaw
        x = scan.ranges[valid] * np.cos(angles) + self._lidar.x
        y = scan.ranges[valid] * np.sin(angles) + self._lidar.y
        return float(x[(x > 0) & (np.abs(y) < self.LANE)].min(initial=math.inf))
