"""The sensor processor: a thread that sleeps on the node's clock and publishes what is there."""

import math
import signal
import sys
from threading import Thread

from geometry_msgs.msg import Vector3
from rcl_interfaces.msg import SetParametersResult
import rclpy
from rclpy.exceptions import InvalidParameterValueException, NotInitializedException
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from rclpy.signals import SignalHandlerOptions
from ros2_robot_controller.msg import SensorFusionData
from sensor_msgs.msg import BatteryState, Imu, LaserScan
from std_msgs.msg import Float32


class SensorProcessor(Node):
    """Everything the sensors say, in one message."""

    def __init__(self):
        super().__init__('sensor_processor')
        self.add_on_set_parameters_callback(self.refuse_nonsense)
        self.declare_parameters('', [
            ('fusion_frequency', 20.0), ('battery_low_threshold', 20.0),
            ('battery_critical_threshold', 10.0)])
        self.scan = None
        self.imu = None
        self.percent = 100.0
        self.told = {'low': False, 'critical': False}
        self.fused = self.create_publisher(SensorFusionData, 'sensor_fusion_data', 5)
        self.distance = self.create_publisher(Float32, 'obstacle_distance', 5)
        self.create_subscription(LaserScan, 'raw_scan', self.take_scan, qos_profile_sensor_data)
        self.create_subscription(Imu, 'imu/data', self.take_imu, qos_profile_sensor_data)
        self.create_subscription(BatteryState, 'battery/state', self.take_battery,
                                 qos_profile_sensor_data)
        self.thread = Thread(target=self.work, daemon=True)
        self.thread.start()

    def refuse_nonsense(self, parameters):
        """Refuse what is not positive."""
        good = all(not isinstance(p.value, float) or 0.0 < p.value < 1e6 for p in parameters)
        return SetParametersResult(successful=good, reason='' if good else 'must be positive')

    def take_scan(self, scan):
        self.scan = scan

    def take_imu(self, imu):
        self.imu = imu

    def take_battery(self, battery):
        if math.isnan(battery.percentage):
            return
        self.percent = min(max(battery.percentage, 0.0), 1.0) * 100.0
        if self.percent < self.get_parameter('battery_low_threshold').value:
            if not self.told['low']:
                self.get_logger().warn('The battery is low.')
            self.told['low'] = True
        if self.percent < self.get_parameter('battery_critical_threshold').value:
            if not self.told['critical']:
                self.get_logger().error('The battery is nearly empty.')
            self.told['critical'] = True

    def work(self):
        # A Rate needs its timer served, which the spinning main thread does.
        rate = self.create_rate(self.get_parameter('fusion_frequency').value)
        try:
            while rclpy.ok():
                rate.sleep()
                if self.scan is not None:
                    self.publish()
        except (rclpy.exceptions.ROSInterruptException, NotInitializedException):
            pass

    def publish(self):
        scan = self.scan
        good = [r for r in scan.ranges if scan.range_min <= r <= scan.range_max and 0 < r < 1e9]
        message = SensorFusionData()
        message.header.stamp = self.get_clock().now().to_msg()
        message.header.frame_id = 'base_link'
        message.closest_obstacle_distance = min(good, default=math.inf)
        message.battery_level = self.percent
        message.linear_acceleration = self.imu.linear_acceleration if self.imu else Vector3()
        message.angular_velocity = self.imu.angular_velocity if self.imu else Vector3()
        self.fused.publish(message)
        self.distance.publish(Float32(data=message.closest_obstacle_distance))


def main():
    """Spin in the main thread until SIGINT or SIGTERM."""
    asked = []
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: asked.append(1))
    rclpy.init(args=sys.argv, signal_handler_options=SignalHandlerOptions.NO)
    try:
        node = SensorProcessor()
    except InvalidParameterValueException as error:
        rclpy.try_shutdown()
        sys.exit(f'sensor_processor: {error}')
    while not asked:
        rclpy.spin_once(node, timeout_sec=0.2)
    rclpy.try_shutdown()  # wakes the thread
    node.thread.join(1.0)
