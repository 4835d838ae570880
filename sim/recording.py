"""Record a run as samples."""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sim.geometry import Pose
from sim.inventory import Event, Presence
from sim.lidar import Array
from sim.sensors import Reading, ScanReading
from sim.simulator import Contact, Simulator
from sim.world import World

COLUMNS = {
    "t": "simulated time, s",
    "x": "true position, map frame, m",
    "y": "true position, map frame, m",
    "yaw": "true heading, rad",
    "v": "true forward speed, m/s",
    "omega": "true turning speed, rad/s",
    "odom_x": "position by odometry, odom frame, m",
    "odom_y": "position by odometry, odom frame, m",
    "odom_yaw": "heading by odometry, rad",
    "cmd_v": "commanded forward speed, m/s",
    "cmd_omega": "commanded turning speed, rad/s",
    "clearance": "hull to the nearest surface, m, inf without obstacles",
    "closest": "closest valid reading of the last scan, m, inf if there is none",
}


THRESHOLDS_NOTE = "thresholds"
"""The note with the distances that plots have a line for: names to metres. Without it they have the default ones."""


@dataclass(frozen=True, eq=False, repr=False)
class Recording:
    """A sampled run.

    Attributes:
        world: where the run took place.
        profile: the name of the robot's profile; `radius` is its hull's, m.
        seed: of the noise.
        samples: one array per column of `COLUMNS`, all of the same length.
        scan_t: when each kept scan was taken, s, shape (scans,).
        scan_index: the sample that each kept scan belongs to, shape (scans,).
        scan_ranges: m, shape (scans, beams).
        scan_angles: of the beams, rad, in the lidar's frame; `lidar` is that frame's pose on the robot.
        contacts, events: as the simulator recorded them.
        presences: the obstacles as they were added, and from when to when each was present.
        unrepeatable: why another run with the same seed may differ, in one sentence; "" if there is no reason.
        movers: for each obstacle that moved or was moved, by name: its centre at each sample, m, shape (samples, 2),
            NaN while it is absent.
        notes: anything else that is worth keeping, plain JSON.
    """

    world: World
    profile: str
    radius: float
    seed: int
    samples: dict[str, Array]
    scan_t: Array
    scan_index: NDArray[np.int64]
    scan_ranges: Array
    scan_angles: Array
    lidar: Pose
    odom_origin: Pose
    contacts: tuple[Contact, ...] = ()
    events: tuple[Event, ...] = ()
    presences: tuple[Presence, ...] = ()
    movers: dict[str, Array] = field(default_factory=dict)
    notes: dict[str, Any] = field(default_factory=dict)
    unrepeatable: str = ""

    def __getattr__(self, name: str) -> Array:
        """Return a column: `recording.x` is `recording.samples["x"]`."""
        if name in COLUMNS and "samples" in vars(self):
            return self.samples[name]
        raise AttributeError(f"a recording has no {name!r}; its columns are {', '.join(COLUMNS)}")

    def __len__(self) -> int:
        return len(self.samples["t"])

    def __repr__(self) -> str:
        # Short, because a notebook shows it as a cell's result.
        return f"Recording({self.world.name!r}: {self.duration:.2f} s simulated, {self.distance:.2f} m driven)"

    @property
    def duration(self) -> float:
        """Simulated time from the first sample to the last, s."""
        t = self.samples["t"]
        return float(t[-1] - t[0]) if t.size else 0.0

    @property
    def distance(self) -> float:
        """Length of the sampled path, m."""
        return float(np.hypot(np.diff(self.samples["x"]), np.diff(self.samples["y"])).sum())

    def pose_at(self, index: int) -> Pose:
        """Return the true pose at a sample, map frame."""
        return Pose(*(float(self.samples[c][index]) for c in ("x", "y", "yaw")))

    def index_at(self, time: float) -> int:
        """Return the index of the last sample that is not after `time` (s), 0 if there is none."""
        return max(0, int(np.searchsorted(self.samples["t"], time + 1e-9, side="right")) - 1)

    def track(self, presence: Presence) -> Array | None:
        """Return an obstacle's centre at each sample, m, shape (samples, 2), None if it never moved.

        While the obstacle is absent, this is its last position, or the position where it will appear.
        """
        track = self.movers.get(presence.obstacle.name)
        if track is None:
            return None
        t = self.samples["t"]
        there = ~np.isnan(track[:, 0]) & (t >= presence.since) & (t <= presence.until)
        if not there.any():
            return np.tile((presence.obstacle.pose.x, presence.obstacle.pose.y), (len(t), 1))
        latest = np.maximum.accumulate(np.where(there, np.arange(len(t)), -1))
        filled: Array = track[np.where(latest < 0, int(np.argmax(there)), latest)]
        return filled

    def digest(self) -> str:
        """Return a hash of the whole recording; two runs have the same if and only if they are bit-identical."""
        facts = (
            self.world, self.profile, self.radius, self.seed, self.lidar, self.odom_origin, self.contacts, self.events,
            self.presences, list(self.movers), self.notes, self.unrepeatable,
        )  # fmt: skip
        scans = (self.scan_t, self.scan_index, self.scan_ranges, self.scan_angles)
        arrays = [*(self.samples[name] for name in COLUMNS), *self.movers.values(), *scans]
        return hashlib.sha256(repr(facts).encode() + b"".join(array.tobytes() for array in arrays)).hexdigest()


class Recorder:
    """Records a run: call `take(readings)` after each step and `recording()` at the end.

    A sample is taken every `period` s, at the first step that is due; every scan is kept.
    """

    def __init__(self, simulator: Simulator, period: float = 0.05) -> None:
        self._simulator = simulator
        self._period = period
        self._rows: list[tuple[float, ...]] = []
        self._scans: list[tuple[int, ScanReading]] = []
        self._closest = simulator.scan().closest
        self._places: list[dict[str, tuple[float, float]]] = []
        self._next = -math.inf
        self.notes: dict[str, Any] = {}
        self.take([])

    def take(self, readings: list[Reading]) -> None:
        """Record the readings of the step just made and, if one is due, a sample."""
        simulator = self._simulator
        now = simulator.time
        for reading in readings:
            if isinstance(reading, ScanReading):
                self._closest = reading.closest
                self._scans.append((len(self._rows), reading))
        if now < self._next - 1e-9:
            return
        # Stay on the grid, so that steps that do not divide the period do not stretch it.
        self._next = now + self._period if self._next < now - self._period else self._next + self._period
        pose, twist, command = simulator.pose, simulator.twist, simulator.commanded
        odom = simulator.odometry().pose
        self._rows.append(
            (
                *(now, pose.x, pose.y, pose.yaw, twist.v, twist.omega, odom.x, odom.y, odom.yaw),
                *(command.v, command.omega, simulator.clearance(), self._closest),
            )
        )
        moved = simulator.moved
        self._places.append(
            {o.name: place for o, place in simulator.obstacles if o.motion is not None or o.name in moved}
        )

    def recording(self) -> Recording:
        """Return everything recorded so far."""
        simulator = self._simulator
        table = np.array(self._rows, dtype=np.float64)
        scans = [(i, s) for i, s in self._scans if i < len(self._rows)]
        beams = simulator.profile.lidar.beams
        return Recording(
            world=simulator.world,
            profile=simulator.profile.name,
            radius=simulator.profile.radius,
            seed=simulator.seed,
            samples={name: table[:, i].copy() for i, name in enumerate(COLUMNS)},
            scan_t=np.array([s.stamp for _, s in scans], dtype=np.float64),
            scan_index=np.array([i for i, _ in scans], dtype=np.int64),
            scan_ranges=np.array([s.ranges for _, s in scans], dtype=np.float64).reshape(len(scans), beams.count),
            scan_angles=beams.angles,
            lidar=simulator.profile.lidar.pose,
            odom_origin=simulator.odom_origin,
            contacts=simulator.contacts,
            events=simulator.events,
            presences=simulator.presences,
            movers=self._tracks(table[:, 0]),
            notes=dict(self.notes),
            unrepeatable=simulator.unrepeatable,
        )

    def _tracks(self, t: Array) -> dict[str, Array]:
        """Return the centre of each obstacle that ever moved at each sample."""
        absent = (math.nan, math.nan)
        names = sorted({name for places in self._places for name in places})
        tracks = {n: np.array([places.get(n, absent) for places in self._places]).reshape(-1, 2) for n in names}
        for presence in self._simulator.presences:
            # The position of an obstacle without a motion is not recorded until it is first moved.
            obstacle, track = presence.obstacle, tracks.get(presence.obstacle.name)
            if track is not None and obstacle.motion is None:
                stood = np.isnan(track[:, 0]) & (t >= presence.since) & (t <= presence.until)
                track[stood] = (obstacle.pose.x, obstacle.pose.y)
        return tracks
