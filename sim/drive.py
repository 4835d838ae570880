"""Drive a simulated robot with a Python function, without ROS, and record the run."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from sim.geometry import Twist
from sim.recording import Recorder, Recording
from sim.sensors import OdometryReading, Reading, ScanReading
from sim.simulator import Simulator

CONTROL_S = 0.1  # the control period: 10 Hz, as in the contract


@dataclass(frozen=True)
class Seen:
    """What a driver knows: the simulated time in s, and the latest scan and odometry."""

    time: float
    scan: ScanReading
    odometry: OdometryReading


Driver = Callable[[Seen], Twist]


def drive(
    simulator: Simulator,
    driver: Driver,
    duration: float,
    period: float = CONTROL_S,
    until: Callable[[], bool] = lambda: False,
) -> Recording:
    """Let the driver command the robot every `period` s for `duration` s of simulated time; return the recording.

    The run ends earlier when `until()` is true.
    """
    recorder = Recorder(simulator)
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


class ControlLoop:
    """A `step` that asks a driver for a command every `CONTROL_S` of simulated time, as `drive` does."""

    def __init__(self, simulator: Simulator, driver: Driver) -> None:
        self.driver = driver
        self._simulator = simulator
        self.restart()

    def restart(self) -> None:
        """Start over after the simulator has been reset."""
        self._due = self._simulator.time
        self._seen = Seen(self._due, self._simulator.scan(), self._simulator.odometry())

    def __call__(self, dt: float) -> None:
        """Advance by `dt` simulated seconds."""
        if self._simulator.time >= self._due - 1e-9:
            command = self.driver(self._seen)
            self._simulator.command(command.v, command.omega)
            self._due += CONTROL_S
        readings = self._simulator.step(dt)
        self._seen = _updated(self._seen, self._simulator.time, readings)


def _updated(seen: Seen, time: float, readings: list[Reading]) -> Seen:
    for reading in readings:
        if isinstance(reading, ScanReading):
            seen = replace(seen, scan=reading)
        elif isinstance(reading, OdometryReading):
            seen = replace(seen, odometry=reading)
    return replace(seen, time=time)
