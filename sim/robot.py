"""Robot profiles: their parameters as data, and the limits of a differential drive. No world, no sensors."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from sim.geometry import Pose, Twist
from sim.lidar import Beams


@dataclass(frozen=True)
class LidarProfile:
    """A lidar: its pose, beams, rate and errors.

    Attributes:
        pose: in base_link.
        rate_hz: lowest and highest scans per second; the motor's rate is drawn from this range at each reset.
        range_min: a nearer surface reads -inf, "too close" (REP 117).
        noise: standard deviation of a reading, relative to the range.
        dropout: probability that a beam reads +inf, whatever is there.
    """

    pose: Pose = field(default_factory=Pose)
    beams: Beams = field(default_factory=Beams)
    rate_hz: tuple[float, float] = (10.0, 10.0)
    range_min: float = 0.15
    noise: float = 0.005
    dropout: float = 0.0
    frame: str = "laser"


@dataclass(frozen=True)
class DriveProfile:
    """A differential drive and its limits.

    Attributes:
        max_v, max_omega: m/s and rad/s, limited independently.
        max_wheel: m/s at a wheel; above it v and omega are scaled together, which keeps the curvature.
        wheel_acceleration: m/s² at a wheel, for speeding up and braking.
        separation: between the wheels, m.
        command_timeout: s without a command after which the robot stops; None for never.
        backup_limit: m that the robot may reverse beyond the distance driven forward; None for no limit.
    """

    max_v: float = 0.5
    max_omega: float = 1.9
    max_wheel: float = math.inf
    wheel_acceleration: float = 5.0
    separation: float = 0.233
    command_timeout: float | None = None
    backup_limit: float | None = None

    def limited(self, v: float, omega: float) -> Twist:
        """Return the command within the drive's limits."""
        v = min(max(v, -self.max_v), self.max_v)
        omega = min(max(omega, -self.max_omega), self.max_omega)
        fastest = abs(v) + abs(omega) * self.separation / 2
        if fastest > self.max_wheel:
            v, omega = v * self.max_wheel / fastest, omega * self.max_wheel / fastest
        return Twist(v, omega)

    def toward(self, now: Twist, target: Twist, dt: float) -> Twist:
        """Return the twist after dt seconds of accelerating from `now` to `target` as fast as the wheels can."""
        half = self.separation / 2
        dv, domega = target.v - now.v, target.omega - now.omega
        most = abs(dv) + abs(domega) * half  # the larger of the two wheels' changes
        allowed = self.wheel_acceleration * dt
        if most <= allowed:
            return target
        # The same factor for both wheels: both arrive at the same time.
        return Twist(now.v + dv * allowed / most, now.omega + domega * allowed / most)


@dataclass(frozen=True)
class OdometryProfile:
    """Wheel odometry: its rate and errors. The scale errors and the veer are drawn once at each reset.

    Attributes:
        scale: standard deviation of the relative error of distances and of angles.
        veer: standard deviation of the rotation measured on a straight line, rad/m (unequal wheels).
        wander: standard deviation of the random walk of the heading, rad per square root of m.
        starts_at_zero: whether the odometry frame starts at the robot; otherwise it coincides with the map frame.
    """

    rate_hz: float = 20.0
    scale: float = 0.001
    veer: float = 0.0003
    wander: float = 0.0003
    starts_at_zero: bool = False


@dataclass(frozen=True)
class ImuProfile:
    """An IMU at the robot's centre. Noise and biases are standard deviations, SI; biases are drawn at each reset."""

    rate_hz: float = 100.0
    acceleration_noise: float = 0.02
    acceleration_bias: float = 0.02
    gyro_noise: float = 0.002
    gyro_bias: float = 0.002


@dataclass(frozen=True)
class BatteryProfile:
    """A battery: drain as a fraction of the charge per second, currents in A (negative when discharging).

    The defaults come from create3_sim's robot_state.hpp: 2.046 Ah, 14.4 V nominal.
    """

    rate_hz: float = 1.0
    drain_idle: float = 5.634e-5
    drain_driving: float = 8.875e-5
    current_idle: float = -0.404
    current_driving: float = -0.526

    def voltage(self, percentage: float) -> float:
        """Return the voltage in V at a charge of 0 to 1: two straight lines that meet at 0.9."""
        at_90 = 16.474 - 3.27 * 0.1
        return at_90 + 6.0 * (percentage - 0.9) if percentage > 0.9 else 16.474 - 3.27 * (1 - percentage)


@dataclass(frozen=True)
class RobotProfile:
    """One kind of robot: a round hull (radius in m), a drive, sensors, and whether cmd_vel is a TwistStamped."""

    name: str = "course"
    radius: float = 0.171
    drive: DriveProfile = field(default_factory=DriveProfile)
    lidar: LidarProfile = field(default_factory=LidarProfile)
    odometry: OdometryProfile = field(default_factory=OdometryProfile)
    imu: ImuProfile = field(default_factory=ImuProfile)
    battery: BatteryProfile = field(default_factory=BatteryProfile)
    stamped_cmd_vel: bool = False


COURSE = RobotProfile()
"""The contract's robot. Its wheels speed up and brake at 5 m/s², so from 0.5 m/s it stops within 0.1 s and 2.5 cm: the
controller's ramp decides, not the robot's. Its odometry starts in the map frame and errs by about 1 cm in 5 m."""

TB4 = RobotProfile(
    name="tb4",
    drive=DriveProfile(
        max_v=0.306,  # create3 with its default safety_override; 0.46 with `full`
        max_omega=1.9,
        max_wheel=0.306,
        wheel_acceleration=0.9,
        command_timeout=0.5,
        backup_limit=0.10,  # an assumption: "only a little further back than it drove forward" is all the docs say
    ),
    lidar=LidarProfile(
        pose=Pose(-0.04, 0.0, math.pi / 2),
        rate_hz=(5.5, 10.0),  # RPLIDAR A1M8, free-running
        noise=0.01,  # data sheet: below 1 % of the distance
        dropout=0.01,  # assumption
        frame="rplidar_link",
    ),
    odometry=OdometryProfile(scale=0.005, veer=0.005, wander=0.003, starts_at_zero=True),
    stamped_cmd_vel=True,
)
"""A TurtleBot 4 (standard) on ROS 2 Jazzy. Sources: Create 3 docs, turtlebot4.urdf.xacro, RPLIDAR data sheet. At the
back the hull ends 0.131 m from the lidar, less than range_min, so a contact there reads -inf."""

PROFILES = {profile.name: profile for profile in (COURSE, TB4)}
