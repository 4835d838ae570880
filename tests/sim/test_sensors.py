"""Sensors: size of the noise, separate random streams, exact without noise; battery; the TurtleBot 4."""

import math
from dataclasses import replace

import numpy as np
import pytest

from sim import COURSE, TB4, Box, Circle, Pose, Simulator, Wall, World, load_world, room
from sim.sensors import BatteryReading, ImuReading, OdometryReading, ScanReading

ROOM = World(obstacles=room((-3.0, -3.0), (3.0, 3.0)))


# ------------------------------------------------------------------------------------------------------------- noise


def test_without_noise_all_sensors_are_exact() -> None:
    simulator = Simulator(load_world("forest"), noise=False)
    simulator.command(0.3, 0.4)
    simulator.step(3.0)
    assert simulator.scan().ranges.tolist() == simulator.true_ranges().tolist()
    assert simulator.odometry().pose == simulator.pose
    assert simulator.odometry().twist.v == pytest.approx(0.3, abs=1e-15)
    assert simulator.odometry().twist.omega == pytest.approx(0.4, abs=1e-15)
    imu = simulator.imu()
    assert imu.angular_velocity == (0.0, 0.0, 0.4)
    assert imu.linear_acceleration == pytest.approx((0.0, 0.3 * 0.4, 9.80665))
    assert imu.yaw == simulator.pose.yaw


def test_lidar_noise_is_gaussian_and_half_a_percent_of_the_range() -> None:
    simulator = Simulator(ROOM)
    errors = []
    for _ in range(60):
        simulator.step(0.1)
        errors.append(simulator.scan().ranges / simulator.true_ranges() - 1)
    sample = np.concatenate(errors)
    assert np.std(sample) == pytest.approx(0.005, rel=0.03)
    assert abs(np.mean(sample)) < 1e-4
    assert np.mean(np.abs(sample) < 0.005) == pytest.approx(0.683, abs=0.01)


def test_reading_twice_gives_the_same_and_has_no_side_effects() -> None:
    quiet, curious = Simulator(ROOM), Simulator(ROOM)
    assert curious.scan().ranges.tolist() == curious.scan().ranges.tolist()
    for _ in range(20):
        curious.imu()
        curious.scan()
        curious.step(0.05)
        quiet.step(0.05)
    assert curious.imu() == quiet.imu()
    assert curious.scan().ranges.tolist() == quiet.scan().ranges.tolist()


def test_the_readings_left_out_of_a_step_change_no_others() -> None:
    whole, partial = Simulator(ROOM), Simulator(ROOM)
    for _ in range(20):
        others = [reading for reading in whole.step(0.05) if isinstance(reading, OdometryReading | BatteryReading)]
        assert partial.step(0.05, without={ImuReading, ScanReading}) == others
    assert partial.scan().ranges.tolist() == whole.scan().ranges.tolist()


def test_each_sensor_has_its_own_random_stream() -> None:
    """A noisier lidar or other obstacles change no reading of the IMU or the odometry."""
    blind = replace(COURSE, lidar=replace(COURSE.lidar, rate_hz=(1.0, 1.0), noise=0.2, dropout=0.5))
    a, b = Simulator(ROOM), Simulator(World(), profile=blind)
    for simulator in (a, b):
        simulator.command(0.3, 0.2)
        simulator.step(2.0)
    assert a.imu() == b.imu()
    assert a.odometry() == b.odometry()


# ------------------------------------------------------------------------------------------------------------- lidar


def test_nothing_in_range_reads_plus_infinity_and_too_close_minus_infinity() -> None:
    """REP 117, with a hull so small that obstacles can come too close."""
    small = replace(COURSE, radius=0.05)
    simulator = Simulator(World(obstacles=(Circle((0.2, 0.0), 0.1),)), profile=small, noise=False)
    ranges = simulator.scan().ranges
    assert ranges[180] == -np.inf
    assert ranges[0] == np.inf
    assert simulator.scan().closest == pytest.approx(float(ranges[np.isfinite(ranges)].min()))


def test_dropouts_are_as_frequent_as_the_profile_says() -> None:
    leaky = replace(COURSE, lidar=replace(COURSE.lidar, dropout=0.1))
    simulator = Simulator(ROOM, profile=leaky)
    lost = []
    for _ in range(40):
        simulator.step(0.1)
        lost.append(np.isinf(simulator.scan().ranges).mean())
    assert np.mean(lost) == pytest.approx(0.1, abs=0.01)


def test_a_scan_is_read_only() -> None:
    with pytest.raises(ValueError, match="read-only"):
        Simulator(ROOM).scan().ranges[0] = 1.0


# --------------------------------------------------------------------------------------------------- odometry and imu


def test_the_course_robots_odometry_errs_by_about_a_centimetre_in_five_metres() -> None:
    errors = []
    for seed in range(30):
        simulator = Simulator(World(), seed=seed)
        simulator.command(0.5, 0.0)
        simulator.step(10.1)
        errors.append(simulator.odometry().pose.distance_to(simulator.pose))
    assert 0.001 < np.median(errors) < 0.02
    assert max(errors) < 0.05


def test_odometry_does_not_drift_while_standing() -> None:
    simulator = Simulator(World())
    simulator.step(20.0)
    assert simulator.odometry().pose == simulator.pose


def test_at_rest_the_imu_measures_gravity_upwards() -> None:
    simulator = Simulator(World())
    rest = np.array([simulator.step(0.01)[0].linear_acceleration for _ in range(500)])
    assert rest.mean(axis=0) == pytest.approx([0.0, 0.0, 9.80665], abs=0.08)
    assert rest.std(axis=0) == pytest.approx([0.02] * 3, rel=0.15)


def test_the_imu_measures_speeding_up_and_braking() -> None:
    simulator = Simulator(World(), noise=False)
    simulator.command(0.5, 0.0)
    simulator.step(0.05)
    assert simulator.imu().linear_acceleration[0] == pytest.approx(5.0)
    simulator.step(1.0)
    simulator.command(0.0, 0.0)
    simulator.step(0.05)
    assert simulator.imu().linear_acceleration[0] == pytest.approx(-5.0)


# ----------------------------------------------------------------------------------------------------------- battery


def test_the_battery_drains_faster_while_driving() -> None:
    idle, driving = Simulator(World()), Simulator(World())
    driving.command(0.3, 0.0)
    for simulator in (idle, driving):
        simulator.step(100.0)
    assert 1 - idle.battery().percentage == pytest.approx(100 * 5.634e-5)
    assert 1 - driving.battery().percentage == pytest.approx(100 * 8.875e-5, rel=1e-3)
    assert driving.battery().current == -0.526
    assert idle.battery().current == -0.404


def test_the_battery_can_be_set_and_its_voltage_follows() -> None:
    simulator = Simulator(World())
    simulator.set_battery(0.5)
    assert simulator.battery().voltage == pytest.approx(16.474 - 3.27 * 0.5)
    with pytest.raises(ValueError, match="not from 0 to 1"):
        simulator.set_battery(50.0)
    with pytest.raises(ValueError, match="not from 0 to 1"):
        simulator.set_battery(math.nan)


# ------------------------------------------------------------------------------------------------------ TurtleBot 4


def tb4(world: World | None = None) -> Simulator:
    return Simulator(world or World(), profile=TB4, noise=False)


def test_the_tb4_scales_v_and_omega_together() -> None:
    """With v 0.306 and omega 1.0 the outer wheel would need 0.4225 m/s, so both are scaled by 0.72."""
    simulator = tb4()
    for _ in range(10):
        simulator.command(0.306, 1.0)
        simulator.step(0.2)
    scale = 0.306 / (0.306 + 0.233 / 2)
    assert simulator.twist.v == pytest.approx(0.306 * scale)
    assert simulator.twist.omega == pytest.approx(scale)
    assert scale == pytest.approx(0.72, abs=0.005)


def test_the_tb4_speeds_up_at_0_9_metres_per_second_squared() -> None:
    simulator = tb4()
    simulator.command(0.3, 0.0)
    simulator.step(0.2)
    assert simulator.twist.v == pytest.approx(0.18)


def test_the_tb4_stops_half_a_second_after_the_last_command_the_course_robot_does_not() -> None:
    for simulator, speed in ((tb4(), 0.0), (Simulator(World()), 0.3)):
        simulator.command(0.3, 0.0)
        simulator.step(2.0)
        assert simulator.twist.v == speed


def test_the_tb4_refuses_to_back_up_far() -> None:
    simulator = tb4()
    for _ in range(30):
        simulator.command(-0.2, 0.0)
        simulator.step(0.1)
    assert [(e.kind, e.subject) for e in simulator.events] == [("hazard", "BACKUP_LIMIT")]
    assert -0.15 < simulator.pose.x < -0.09
    simulator.command(0.2, 0.0)
    simulator.step(0.4)
    assert [e.kind for e in simulator.events] == ["hazard", "hazard over"]


def test_the_tb4s_lidar_faces_left_and_is_behind_the_centre() -> None:
    simulator = tb4(World(obstacles=(Wall((2.0, -5.0), (2.0, 5.0)),)))
    ranges = simulator.scan().ranges
    angles = simulator.scan().angles
    ahead = int(np.argmin(np.abs(angles + math.pi / 2)))
    assert ranges[ahead] == pytest.approx(2.04)
    assert int(np.argmin(ranges)) == ahead


def test_a_contact_behind_the_tb4_is_too_close_to_be_measured() -> None:
    simulator = tb4(World(obstacles=(Box((-1.0, 0.0), (1.65, 4.0)),)))
    assert 0.0 < simulator.clearance() < 0.01
    assert (simulator.scan().ranges == -np.inf).any()


def test_the_seed_draws_the_tb4s_scan_rate_from_5_5_to_10_hz() -> None:
    rates = []
    for seed in range(20):
        simulator = Simulator(World(), profile=TB4, seed=seed)
        rates.append(sum(hasattr(r, "ranges") for r in simulator.step(20.0)) / 20)
    assert 5.4 <= min(rates) < 6.5
    assert 8.5 < max(rates) <= 10.0


def test_the_tb4s_odometry_starts_at_zero_anywhere() -> None:
    simulator = tb4(World(start=Pose(3.0, 4.0, 1.0)))
    assert simulator.odometry().pose.distance_to(Pose()) < 1e-12
    for _ in range(5):
        simulator.command(0.2, 0.1)
        simulator.step(0.4)
    back = simulator.odom_origin.compose(simulator.odometry().pose)
    assert back.distance_to(simulator.pose) < 1e-9
