"""Who drives a live robot that no node drives: a function that is asked every 0.1 s, or a tourist who obeys clicks."""

from __future__ import annotations

from sim.drive import Driver, Seen, Tourist
from sim.sensors import OdometryReading, ScanReading
from sim.simulator import Simulator

CONTROL_S = 0.1  # how often a driver is asked, as in `sim.drive`; also what the Step button advances


class Guide(Tourist):
    """The driver of a view that is given none: visits the world's goals, and whatever place is clicked."""

    def go_to(self, x: float, y: float) -> None:
        """Drop what was planned and go to a place (m, map frame)."""
        self._goals, self._way, self._endless = [(x, y)], [], False


class Drive:
    """A `step` that asks a driver every `CONTROL_S` of simulated time, as `sim.drive` does."""

    def __init__(self, simulator: Simulator, driver: Driver) -> None:
        self.driver = driver
        self._simulator = simulator
        self.restart()

    def restart(self) -> None:
        """Begin anew after a reset."""
        self._due = self._simulator.time
        self._seen = Seen(self._due, self._simulator.scan(), self._simulator.odometry())

    def __call__(self, dt: float) -> None:
        """Advance by `dt` simulated seconds."""
        if self._simulator.time >= self._due - 1e-9:
            command = self.driver(self._seen)
            self._simulator.command(command.v, command.omega)
            self._due += CONTROL_S
        scan, odometry = self._seen.scan, self._seen.odometry
        for reading in self._simulator.step(dt):
            if isinstance(reading, ScanReading):
                scan = reading
            elif isinstance(reading, OdometryReading):
                odometry = reading
        self._seen = Seen(self._simulator.time, scan, odometry)
