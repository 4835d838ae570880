"""The node that fuses the sensors, on a bench."""

import math
from pathlib import Path
import signal

from geometry_msgs.msg import Vector3
import pytest
import rclpy
from rclpy.exceptions import InvalidParameterValueException
from rclpy.qos import ReliabilityPolicy
from ros2_robot_controller.msg import SensorFusionData
from ros2_robot_controller.robot_controller import RobotController
from ros2_robot_controller.sensor_processor import (
    alarm_state, battery_percent, main, SensorProcessor)
from sensor_msgs.msg import BatteryState, Imu, LaserScan
from std_msgs.msg import Float32

CONFIG = Path(__file__).parent.parent / 'config'
SENSELESS = [('fusion_frequency', 0.0), ('fusion_frequency', -20.0),
             ('battery_low_threshold', -1.0), ('battery_critical_threshold', 101.0)]


@pytest.fixture
def bench(make_bench):
    """Return a bench with the node on it."""
    return make_bench(SensorProcessor)


def scan_of(*ranges):
    """Return a scan that is good from 0.15 m to 12 m."""
    return LaserScan(ranges=ranges, range_min=0.15, range_max=12.0, angle_increment=0.1)


# Battery, in numbers

@pytest.mark.parametrize(('percentage', 'percent'), [
    (0.0, 0.0), (0.5, 50.0), (1.0, 100.0), (1.2, 100.0), (-0.2, 0.0), (math.nan, 42.0),
])
def test_a_battery_reports_a_share_of_one(percentage, percent):
    assert battery_percent(percentage, previous=42.0) == pytest.approx(percent)


@pytest.mark.parametrize(('was_on', 'percent', 'is_on'), [
    (False, 19.9, True), (False, 20.0, False), (False, 21.0, False),
    (True, 19.9, True), (True, 21.9, True), (True, 22.0, False),
])
def test_an_alarm_ends_well_above_where_it_starts(was_on, percent, is_on):
    assert alarm_state(was_on, percent, 20.0) is is_on


# The graph

def test_names_and_types_are_relative_and_as_agreed(bench):
    assert bench.node.get_name() == 'sensor_processor'
    for topic, message_type in (
            ('raw_scan', LaserScan), ('imu/data', Imu), ('battery/state', BatteryState)):
        subscription = bench.subscription(topic)
        assert subscription.msg_type is message_type
        assert subscription.qos_profile.reliability == ReliabilityPolicy.BEST_EFFORT
    for topic, message_type in (
            ('sensor_fusion_data', SensorFusionData), ('obstacle_distance', Float32)):
        publisher = bench.publisher(topic)
        assert publisher.msg_type is message_type
        qos = publisher.qos_profile
        assert (qos.reliability, qos.depth) == (ReliabilityPolicy.RELIABLE, 10)


# Fused data

def test_nothing_is_published_before_the_first_scan(bench, published):
    bench.hear('imu/data', Imu())
    bench.hear('battery/state', BatteryState(percentage=0.5))
    bench.advance(1.0)
    assert published['sensor_fusion_data'] == []
    assert published['obstacle_distance'] == []


def test_after_the_first_scan_data_comes_twenty_times_a_second(bench, published):
    bench.hear('raw_scan', scan_of(3.0, 2.0, math.inf))
    bench.advance(1.0)
    assert len(published['sensor_fusion_data']) == 20
    assert [m.data for m in published['obstacle_distance']] == [2.0] * 20
    fused = published['sensor_fusion_data'][-1]
    assert fused.header.frame_id == 'base_link'
    assert (fused.header.stamp.sec, fused.header.stamp.nanosec) == (1, 0)
    assert fused.closest_obstacle_distance == 2.0


def test_without_other_sensors_the_battery_is_full_and_the_robot_at_rest(bench, published):
    bench.hear('raw_scan', scan_of(3.0))
    bench.advance(0.05)
    fused = published['sensor_fusion_data'][-1]
    assert fused.battery_level == 100.0
    assert fused.linear_acceleration == fused.angular_velocity == Vector3()


def test_the_latest_of_each_sensor_is_in_the_data(bench, published):
    bench.hear('raw_scan', scan_of(3.0))
    bench.hear('raw_scan', scan_of(math.nan, 4.0, 0.0))
    bench.hear('battery/state', BatteryState(percentage=0.25))
    bench.hear('imu/data', Imu(linear_acceleration=Vector3(x=1.0, y=2.0, z=3.0),
                               angular_velocity=Vector3(x=4.0, y=5.0, z=6.0)))
    bench.advance(0.05)
    fused = published['sensor_fusion_data'][-1]
    assert fused.closest_obstacle_distance == 4.0
    assert fused.battery_level == 25.0
    assert fused.linear_acceleration == Vector3(x=1.0, y=2.0, z=3.0)
    assert fused.angular_velocity == Vector3(x=4.0, y=5.0, z=6.0)


@pytest.mark.parametrize('ranges', [(), (math.inf,), (math.nan, 0.0, 0.1, 13.0)])
def test_a_scan_of_nothing_is_infinitely_far(bench, published, ranges):
    bench.hear('raw_scan', scan_of(*ranges))
    bench.advance(0.05)
    assert published['sensor_fusion_data'][-1].closest_obstacle_distance == math.inf
    assert published['obstacle_distance'][-1].data == math.inf


def test_a_battery_that_cannot_measure_keeps_its_last_level(bench, published):
    bench.hear('raw_scan', scan_of(3.0))
    bench.hear('battery/state', BatteryState(percentage=0.75))
    bench.hear('battery/state', BatteryState(percentage=math.nan))
    bench.advance(0.05)
    assert published['sensor_fusion_data'][-1].battery_level == 75.0


# Alarms

def test_each_alarm_sounds_once_on_the_way_down(bench, logged):
    for percentage in (0.5, 0.19, 0.15, 0.21, 0.19, 0.09, 0.05, 0.11, 0.09, 0.01):
        bench.hear('battery/state', BatteryState(percentage=percentage))
    assert logged == [('WARN', 'Battery low: 19 %'), ('ERROR', 'Battery critical: 9 %')]


def test_an_alarm_sounds_again_after_charging(bench, logged):
    for percentage in (0.19, 0.5, 0.18):
        bench.hear('battery/state', BatteryState(percentage=percentage))
    assert [severity for severity, _ in logged] == ['WARN', 'WARN']


def test_a_battery_that_is_nearly_empty_from_the_start_sounds_both_alarms(bench, logged):
    bench.hear('battery/state', BatteryState(percentage=0.05))
    assert [severity for severity, _ in logged] == ['WARN', 'ERROR']


def test_the_thresholds_are_parameters(make_bench, logged):
    bench = make_bench(SensorProcessor, battery_low_threshold=50.0,
                       battery_critical_threshold=30.0)
    bench.hear('battery/state', BatteryState(percentage=0.4))
    bench.set_parameter('battery_critical_threshold', 45.0)
    bench.hear('battery/state', BatteryState(percentage=0.4))
    assert [severity for severity, _ in logged] == ['WARN', 'ERROR']


# Parameters

def test_the_defaults_are_those_of_the_contract(bench):
    names = ['fusion_frequency', 'battery_low_threshold', 'battery_critical_threshold']
    assert [bench.node.get_parameter(name).value for name in names] == [20.0, 20.0, 10.0]


@pytest.mark.parametrize(('name', 'value'), SENSELESS)
def test_a_senseless_value_is_refused_at_start_and_at_run_time(make_bench, bench, name, value):
    with pytest.raises(InvalidParameterValueException, match=name):
        make_bench(SensorProcessor, **{name: value})
    assert not bench.set_parameter(name, value).successful


def test_another_frequency_counts_at_start_and_at_once(make_bench, published):
    bench = make_bench(SensorProcessor, fusion_frequency=10.0)
    bench.hear('raw_scan', scan_of(3.0))
    bench.advance(1.0)
    assert len(published['sensor_fusion_data']) == 10
    bench.set_parameter('fusion_frequency', 5.0)
    bench.advance(1.0)
    assert len(published['sensor_fusion_data']) == 15


def test_another_parameter_leaves_the_rhythm_alone(bench, published):
    """A timer made anew would start its period anew."""
    bench.hear('raw_scan', scan_of(3.0))
    bench.set_parameter('fusion_frequency', 5.0)
    bench.advance(0.15)
    bench.set_parameter('battery_low_threshold', 30.0)
    bench.advance(0.05)
    assert len(published['sensor_fusion_data']) == 1


@pytest.mark.parametrize(('node_class', 'file_name', 'parameter', 'line'), [
    (RobotController, 'robot_params.yaml', 'max_linear_speed', 'max_linear_speed: 0.5 '),
    (SensorProcessor, 'sensor_params.yaml', 'fusion_frequency', 'fusion_frequency: 20.0 '),
])
@pytest.mark.parametrize('namespace', ['', '/left'])
def test_the_parameter_file_reaches_its_node(
        make_bench, tmp_path, node_class, file_name, parameter, line, namespace):
    """The file as it is says what the node thinks anyway, so change one line of it."""
    text = (CONFIG / file_name).read_text()
    assert line in text
    changed = tmp_path / file_name
    changed.write_text(text.replace(line, f'{parameter}: 7.5 '))
    make_bench(SensorProcessor)
    node = node_class(namespace=namespace,
                      cli_args=['--ros-args', '--params-file', str(changed)])
    value = node.get_parameter(parameter).value
    node.destroy_node()
    assert value == 7.5


# The end

@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_it(interrupt, number):
    interrupt(number)
    assert main() == 0
    assert not rclpy.ok()


def test_a_senseless_value_on_the_command_line_ends_it_in_words(logged):
    assert main(['--ros-args', '-p', 'fusion_frequency:=0.0']) == 1
    assert logged[-1] == (
        'FATAL', 'Invalid parameter value (0.0) for parameter. Reason: fusion_frequency must be'
        ' above 0 and at most 1000 Hz, not 0.0: fusion_frequency')
