"""The sensors' readings and their noise. Every sensor has its own random stream; all noise can be turned off."""

from __future__ import annotations

import zlib
from dataclasses import dataclass

import numpy as np

from sim.geometry import Pose, Twist
from sim.lidar import Array
from sim.robot import ImuProfile, LidarProfile, OdometryProfile

Vector = tuple[float, float, float]

GRAVITY = 9.80665  # m/s², standard


@dataclass(frozen=True)
class ScanReading:
    """A lidar scan in the lidar's frame, m and rad; +inf for nothing in range, -inf for too close (REP 117)."""

    stamp: float
    angle_min: float
    angle_increment: float
    range_min: float
    range_max: float
    ranges: Array

    @property
    def angles(self) -> Array:
        """The angle of each beam in rad, shape (beams,)."""
        return self.angle_min + self.angle_increment * np.arange(self.ranges.size, dtype=np.float64)

    @property
    def closest(self) -> float:
        """The smallest valid range in m, inf if there is none."""
        valid = self.ranges[(self.ranges >= self.range_min) & (self.ranges <= self.range_max)]
        return float(valid.min()) if valid.size else float("inf")


@dataclass(frozen=True)
class OdometryReading:
    """Pose (odom frame) and twist (base_link) by wheel odometry."""

    stamp: float
    pose: Pose
    twist: Twist


@dataclass(frozen=True)
class ImuReading:
    """Heading in the odom frame (rad), acceleration with gravity (m/s², +9.81 on z at rest, REP 145), rates (rad/s)."""

    stamp: float
    yaw: float
    linear_acceleration: Vector
    angular_velocity: Vector


@dataclass(frozen=True)
class BatteryReading:
    """Charge (0 to 1), voltage (V) and current (A, negative when discharging)."""

    stamp: float
    percentage: float
    voltage: float
    current: float


Reading = ScanReading | OdometryReading | ImuReading | BatteryReading


class NoiseStream:
    """The random numbers of one sensor, addressed by an index: the same seed, name and index give the same numbers.

    So a reading depends neither on which readings were taken before it nor on which other sensors exist.
    """

    def __init__(self, seed: int, name: str) -> None:
        key = np.random.SeedSequence(entropy=seed, spawn_key=(zlib.crc32(name.encode()),))
        self._philox = np.random.Philox(key=key.generate_state(2, np.uint64))
        self._generator = np.random.Generator(self._philox)
        self._state = self._philox.state

    def at(self, index: int) -> np.random.Generator:
        """Return the generator, set to the first of the numbers that belong to `index`. Use it at once."""
        # Philox is counter-based: each index owns 2**192 numbers. Setting the state takes 2 µs, a new generator 16 µs.
        self._state["state"]["counter"][3] = index
        self._state["buffer_pos"] = 4
        self._state["has_uint32"] = 0
        self._philox.state = self._state
        return self._generator


class LidarModel:
    """Turns exact ranges into a scan."""

    def __init__(self, profile: LidarProfile, seed: int, noise: bool) -> None:
        self._profile = profile
        self._noise = noise
        self._stream = NoiseStream(seed, "lidar")
        low, high = profile.rate_hz
        self.rate_hz = float(NoiseStream(seed, "lidar rate").at(0).uniform(low, high)) if noise and low < high else low

    def scan(self, ranges: Array, tick: int, stamp: float) -> ScanReading:
        """Return the scan: noise proportional to the range, then dropouts, then REP 117's infinities."""
        p = self._profile
        if self._noise:
            random = self._stream.at(tick)
            factors = random.standard_normal(ranges.size)
            factors *= p.noise
            factors += 1.0
            ranges = np.multiply(ranges, factors, out=factors)
            if p.dropout:
                ranges[random.random(ranges.size) < p.dropout] = np.inf
        else:
            ranges = ranges.copy()
        ranges[ranges > p.beams.range_max] = np.inf
        ranges[ranges < p.range_min] = -np.inf
        ranges.flags.writeable = False
        return ScanReading(stamp, p.beams.angle_min, p.beams.increment, p.range_min, p.beams.range_max, ranges)


class ImuModel:
    """Turns the true motion into IMU readings."""

    def __init__(self, profile: ImuProfile, seed: int, noise: bool) -> None:
        self._profile = profile
        self._noise = noise
        self._stream = NoiseStream(seed, "imu")
        bias = NoiseStream(seed, "imu bias").at(0).standard_normal(6)
        self._bias = [profile.acceleration_bias * b for b in bias[:3]] + [profile.gyro_bias * b for b in bias[3:]]

    def read(self, yaw: float, acceleration: Vector, omega: float, tick: int, stamp: float) -> ImuReading:
        """Return the reading; `acceleration` is the specific force in base_link, with gravity."""
        if not self._noise:
            return ImuReading(stamp, yaw, acceleration, (0.0, 0.0, omega))
        p, b = self._profile, self._bias
        z = self._stream.at(tick).standard_normal(6).tolist()
        a, g = p.acceleration_noise, p.gyro_noise
        force = (
            acceleration[0] + b[0] + a * z[0],
            acceleration[1] + b[1] + a * z[1],
            acceleration[2] + b[2] + a * z[2],
        )
        return ImuReading(stamp, yaw, force, (b[3] + g * z[3], b[4] + g * z[4], omega + b[5] + g * z[5]))


class OdometryModel:
    """The errors of wheel odometry: scaled distances and angles, a veer on straight lines, a wandering heading."""

    BLOCK = 1024  # random numbers drawn at a time: one per substep

    def __init__(self, profile: OdometryProfile, seed: int, noise: bool) -> None:
        z = NoiseStream(seed, "odometry scale").at(0).standard_normal(3).tolist() if noise else [0.0, 0.0, 0.0]
        self._noise = noise
        self._distance = 1.0 + profile.scale * z[0]
        self._angle = 1.0 + profile.scale * z[1]
        self._veer = profile.veer * z[2]
        self._wander = profile.wander
        self._stream = NoiseStream(seed, "odometry")
        self._block = -1
        self._walk: list[float] = []

    def measured(self, ds: float, dyaw: float, tick: int) -> tuple[float, float]:
        """Return the distance (m) and rotation (rad) that the wheels report for the true ones of a substep."""
        if not self._noise:
            return ds, dyaw
        block, place = divmod(tick, self.BLOCK)
        if block != self._block:
            self._block, self._walk = block, self._stream.at(block).standard_normal(self.BLOCK).tolist()
        walk = self._wander * self._walk[place] * abs(ds) ** 0.5
        return ds * self._distance, dyaw * self._angle + ds * self._veer + walk
