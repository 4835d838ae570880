"""What counts as a reading, and where it lies."""

import math

import pytest
from ros2_robot_controller.utils.scans import closest_reading, measure_proximity, Proximity
from sensor_msgs.msg import LaserScan

INF = math.inf


def scan_of(*ranges, angle_min=0.0, step=math.radians(10.0)):
    """Return a scan that is good from 0.15 m to 12 m."""
    return LaserScan(ranges=ranges, range_min=0.15, range_max=12.0, angle_min=angle_min,
                     angle_increment=step)


@pytest.mark.parametrize('invalid', [math.nan, INF, -INF, 0.0, -1.0, 0.1, 12.5])
def test_an_invalid_reading_hides_no_real_one(invalid):
    assert closest_reading(scan_of(invalid, 2.0, invalid, 3.0)) == 2.0
    assert closest_reading(scan_of(invalid, invalid)) == INF


def test_zero_is_no_reading_even_where_the_scan_allows_it():
    assert closest_reading(LaserScan(ranges=[0.0, 1.0], range_min=0.0, range_max=12.0)) == 1.0


def test_infinity_is_no_reading_even_where_the_scan_allows_it():
    assert closest_reading(LaserScan(ranges=[INF], range_min=0.0, range_max=INF)) == INF
    assert list(measure_proximity(
        LaserScan(ranges=[INF, 2.0], range_max=INF)).__dict__.values()) == [2.0, INF, 2.0]


def test_the_ends_of_the_range_are_in_it():
    scan = LaserScan(ranges=[0.25], range_min=0.25, range_max=8.0)
    assert closest_reading(scan) == 0.25
    scan.ranges = [8.0]
    assert closest_reading(scan) == 8.0


def test_a_scan_with_no_readings_is_free():
    assert closest_reading(scan_of()) == INF
    assert measure_proximity(scan_of()) == Proximity(ahead=INF, behind=INF, anywhere=INF)


@pytest.mark.parametrize(('degrees', 'ahead', 'behind'), [
    (0.0, 1.0, INF), (59.0, 1.0, INF), (-59.0, 1.0, INF), (359.0, 1.0, INF),
    (61.0, INF, INF), (-61.0, INF, INF), (119.0, INF, INF), (-119.0, INF, INF),
    (121.0, INF, 1.0), (-121.0, INF, 1.0), (180.0, INF, 1.0), (-180.0, INF, 1.0),
])
def test_where_a_thing_is_goes_by_the_angle_of_its_beam(degrees, ahead, behind):
    near = measure_proximity(scan_of(1.0, angle_min=math.radians(degrees)))
    assert near == Proximity(ahead=ahead, behind=behind, anywhere=1.0)


def test_each_beam_is_one_step_on():
    """The third beam of a scan that starts at -20 degrees with steps of 10 looks straight on."""
    near = measure_proximity(scan_of(INF, INF, 2.0, angle_min=math.radians(-20.0)))
    assert near.ahead == 2.0
    near = measure_proximity(scan_of(INF, INF, 2.0, angle_min=math.radians(60.0)))
    assert near.ahead == INF


def test_the_nearest_of_each_direction_counts():
    ranges = [5.0] * 36
    ranges[1], ranges[2], ranges[9], ranges[18], ranges[19] = 3.0, 2.0, 1.0, 4.0, 4.5
    assert measure_proximity(scan_of(*ranges)) == Proximity(ahead=2.0, behind=4.0, anywhere=1.0)
