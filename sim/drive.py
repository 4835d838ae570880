"""Drive a simulated robot with a function, without ROS, and record it. And a simple driver to begin with."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

from sim.geometry import Pose, Twist, normalize_angle
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


def drive(simulator: Simulator, driver: Driver, duration: float, period: float = 0.1, scan_every: int = 1) -> Recording:
    """Let the driver command the robot every `period` s for `duration` s of simulated time; return the recording."""
    recorder = Recorder(simulator, scan_every=scan_every)
    seen = Seen(simulator.time, simulator.scan(), simulator.odometry())
    end = simulator.time + duration
    sample = min(0.05, period)
    while simulator.time < end - 1e-9:
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


class Wanderer:
    """Drives to the goals one after the other, around what is in the way; without goals it just keeps going.

    A picture of a robot that moves, not a model solution: it steers to the free direction nearest to the goal's.
    """

    CRUISE = 0.4  # m/s
    ROOM = 0.35  # m kept free of the beams beside the path: hull radius and as much again
    ARRIVED = 0.15  # m

    def __init__(self, goals: tuple[Pose, ...] = (), lidar_yaw: float = 0.0) -> None:
        self._goals = list(goals)
        self._endless = not goals
        self._lidar_yaw = lidar_yaw

    def __call__(self, seen: Seen) -> Twist:
        """Return the command for what is seen."""
        pose = seen.odometry.pose
        while self._goals and pose.distance_to(self._goals[0]) < self.ARRIVED:
            self._goals.pop(0)
        if not self._goals and not self._endless:
            return Twist()
        wanted, distance = 0.0, 2.0
        if self._goals:
            goal = self._goals[0]
            wanted = normalize_angle(math.atan2(goal.y - pose.y, goal.x - pose.x) - pose.yaw)
            distance = pose.distance_to(goal)
        heading, free = self._best_heading(seen.scan, wanted, min(distance, 1.5))
        v = self.CRUISE * max(0.0, math.cos(heading)) * min(1.0, free) if abs(heading) < 1.0 else 0.0
        return Twist(min(v, 0.1 + distance), max(-1.2, min(1.2, 2.0 * heading)))

    def _best_heading(self, scan: ScanReading, wanted: float, reach: float) -> tuple[float, float]:
        """Return the heading (rad from straight ahead) that is free and nearest to `wanted`, and its room in m."""
        points = [
            (r, normalize_angle(a + self._lidar_yaw))
            for r, a in zip(scan.ranges.tolist(), scan.angles.tolist(), strict=True)
            if scan.range_min <= r <= reach + self.ROOM
        ]
        best = (math.inf, 0.0, 0.0)
        for step in range(-36, 36):
            heading = math.radians(5 * step)
            free = min((self._room(r, bearing - heading) for r, bearing in points), default=reach)
            short = max(0.0, reach - free)
            cost = abs(normalize_angle(heading - wanted)) + 3.0 * short + 0.1 * abs(heading)
            best = min(best, (cost, heading, free))
        return best[1], best[2]

    def _room(self, distance: float, bearing: float) -> float:
        """Return how far one can go straight ahead before passing nearer than `ROOM` to a point."""
        ahead, beside = distance * math.cos(bearing), abs(distance * math.sin(bearing))
        if ahead <= 0 or beside >= self.ROOM:
            return math.inf
        return max(0.0, ahead - math.sqrt(self.ROOM**2 - beside**2))
