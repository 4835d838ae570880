"""The guard on a bench: messages go straight into its callbacks, so no test waits."""

import math
import os
import signal

from hall_guard.guard import distance_ahead, Guard, main
import pytest
import rclpy
from rclpy.exceptions import InvalidParameterValueException
from rclpy.parameter import Parameter
from rclpy.publisher import Publisher
from sensor_msgs.msg import LaserScan
from std_srvs.srv import SetBool


def scan_of(*ranges, angle_min=0.0, increment=0.0):
    return LaserScan(ranges=ranges, angle_min=angle_min, angle_increment=increment,
                     range_min=0.15, range_max=12.0)


@pytest.fixture
def published(monkeypatch):
    speeds = []
    publish = Publisher.publish

    def record(publisher, message):
        if publisher.topic.endswith('cmd_vel'):
            speeds.append(message.linear.x)
        publish(publisher, message)

    monkeypatch.setattr(Publisher, 'publish', record)
    return speeds


@pytest.fixture
def context():
    rclpy.init()
    yield
    rclpy.try_shutdown()


@pytest.fixture
def guard(context):
    node = Guard(namespace=f'/bench{os.getpid()}', start_parameter_services=False)
    yield node
    node.destroy_node()


def hear(guard, scan):
    next(iter(guard.subscriptions)).callback(scan)


def send(guard, patrol):
    service = next(s for s in guard.services if s.service_name.endswith('/patrol'))
    return service.callback(SetBool.Request(data=patrol), SetBool.Response())


def tick(guard):
    next(iter(guard.timers)).callback()


def test_only_what_is_ahead_and_valid_counts():
    assert distance_ahead(scan_of(2.0, 1.5, 3.0)) == 1.5
    assert distance_ahead(scan_of(math.inf, math.nan, 0.1, 13.0)) == math.inf
    assert distance_ahead(scan_of(0.15)) == pytest.approx(0.15)
    assert distance_ahead(scan_of(12.0)) == 12.0
    beside = scan_of(1.0, 2.0, 1.0, angle_min=-0.6, increment=0.6)
    assert distance_ahead(beside) == 2.0
    assert distance_ahead(scan_of(1.0, angle_min=math.tau - 0.1)) == 1.0
    assert distance_ahead(scan_of(3.0, 1.0, angle_min=0.0, increment=-0.5)) == 1.0


def test_stands_until_it_is_sent_and_after_it_is_called_back(guard, published):
    hear(guard, scan_of(2.0))
    tick(guard)
    answers = [send(guard, True)]
    tick(guard)
    answers.append(send(guard, False))
    tick(guard)
    assert published == [0.0, 0.25, 0.0]
    assert [answer.success for answer in answers] == [True, True]
    assert [answer.message for answer in answers] == ['on patrol', 'off patrol']


def test_stands_without_a_scan_and_before_a_wall(guard, published):
    send(guard, True)
    tick(guard)
    for distance in (0.76, 0.75):
        hear(guard, scan_of(distance))
        tick(guard)
    assert published == [0.0, 0.25, 0.0]


def test_goes_by_its_parameters(guard, published):
    guard.set_parameters([Parameter('patrol_speed', value=0.5),
                          Parameter('stop_distance', value=1.0)])
    send(guard, True)
    for distance in (1.25, 0.75):
        hear(guard, scan_of(distance))
        tick(guard)
    assert published == [0.5, 0.0]


@pytest.mark.parametrize('name', ['patrol_speed', 'stop_distance'])
@pytest.mark.parametrize('value', [-1.0, 0.0, math.inf])
def test_a_senseless_value_is_refused(context, guard, name, value):
    result = guard.set_parameters([Parameter(name, value=value)])[0]
    assert not result.successful
    assert result.reason == f'{name} must be above 0, not {value}'
    with pytest.raises(InvalidParameterValueException):
        Guard(parameter_overrides=[Parameter(name, value=value)])


def test_its_control_loop_has_ten_hertz(guard):
    assert next(iter(guard.timers)).timer_period_ns == 100_000_000


def test_stops_in_the_end(guard, published):
    guard.stop()
    assert published == [0.0]


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_it(monkeypatch, published, number):
    monkeypatch.setattr(Guard, '_control', lambda _: os.kill(os.getpid(), number))
    assert main() == 0
    assert published == [0.0]
    assert not rclpy.ok()


def test_a_senseless_value_on_the_command_line_ends_it():
    assert main(['--ros-args', '-p', 'patrol_speed:=0.0']) == 1
