"""Each layer of robot_controller is a node that works without those above it."""

import math

from geometry_msgs.msg import Twist
import pytest
from ros2_robot_controller.driver import Driver
from ros2_robot_controller.navigator import Navigator
from ros2_robot_controller.speed_server import SpeedServer
from ros2_robot_controller.srv import GetRobotStatus, SetSpeed
from sensor_msgs.msg import LaserScan


class Cruiser(Driver):
    """A layer as somebody else might write it: it drives off by itself."""

    def __init__(self, **node_options):
        super().__init__(**node_options)
        self._speed = 0.3


def scan_of(ahead):
    """Return a scan of three beams."""
    return LaserScan(ranges=[math.inf, ahead, math.inf], angle_min=-0.5, angle_increment=0.5,
                     range_min=0.15, range_max=12.0)


@pytest.fixture
def drive(published):
    """Return a function: drive for a second at this distance of a wall; give the speeds."""
    def drive(bench, ahead=math.inf):
        before = len(published['cmd_vel'])
        bench.advance(1.0, lambda: bench.hear('scan', scan_of(ahead)))
        return [round(command.linear.x, 6) for command in published['cmd_vel'][before:]]

    return drive


@pytest.mark.parametrize('layer', [Driver, SpeedServer, Navigator])
def test_every_layer_says_zero_ten_times_a_second(make_bench, drive, layer):
    bench = make_bench(layer)
    assert bench.node.get_name() == 'robot_controller'
    assert drive(bench) == [0.0] * 10


def test_a_driver_drives_at_the_speed_in_force_and_stops_for_obstacles(make_bench, drive):
    bench = make_bench(Cruiser)
    assert drive(bench) == [0.1, 0.2] + [0.3] * 8
    assert set(drive(bench, ahead=0.4)) == {0.0}
    assert drive(bench)[-1] == 0.3


@pytest.mark.parametrize(('age', 'speed'), [(0.5, 0.3), (0.6, 0.0), (-0.5, 0.3), (-0.6, 0.0)])
def test_a_scan_is_as_old_as_its_stamp_says(make_bench, published, age, speed):
    bench = make_bench(Cruiser)
    bench.set_clock(10 * 10**9)
    for _ in range(4):
        bench.hear('scan', scan_of(math.inf), age)
        bench.node._control()
        bench.set_clock(bench.now_ns + 10**8)
    assert published['cmd_vel'][-1].linear.x == pytest.approx(speed)


def test_a_driver_stops_when_told(make_bench, published, drive):
    bench = make_bench(Cruiser)
    assert drive(bench)[-1] == 0.3
    bench.node.stop()
    assert published['cmd_vel'][-1] == Twist()


def test_a_speed_server_drives_at_the_set_speed_and_tells_it(make_bench, drive):
    bench = make_bench(SpeedServer)
    assert bench.ask('set_speed', SetSpeed.Request(speed=0.25)).success
    assert drive(bench)[-1] == 0.25
    status = bench.ask('get_status', GetRobotStatus.Request())
    assert (status.speed, status.status) == (0.25, 'ACTIVE')
    drive(bench, ahead=0.4)
    status = bench.ask('get_status', GetRobotStatus.Request())
    assert (status.speed, status.status) == (0.25, 'OBSTACLE_DETECTED')
