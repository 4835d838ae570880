#!/usr/bin/env python3
"""Fuse sensors from events."""

from functools import partial
import math

from rcl_interfaces.msg import SetParametersResult
from rclpy.node import Node
from ros2_robot_controller.msg import SensorFusionData
from ros2_robot_controller.robot_controller import SENSOR_QOS, spin
from ros2_robot_controller.utils.conversions import clamp
from ros2_robot_controller.utils.scans import closest_reading
from sensor_msgs.msg import BatteryState, Imu, LaserScan
from std_msgs.msg import Float32

DEFAULTS = {'fusion_frequency': 20.0, 'battery_low_threshold': 20.0,
            'battery_critical_threshold': 10.0}


class SensorProcessor(Node):
    """Keep the latest message of each sensor in `heard`; look at them at the fusion frequency."""

    def __init__(self):
        super().__init__('sensor_processor')
        self.settings = dict(DEFAULTS)
        self.add_on_set_parameters_callback(self.take_parameters)
        for name, default in DEFAULTS.items():
            self.settings[name] = self.declare_parameter(name, default).value
        self.heard = {}
        self.worst = 0  # 1 once the battery was low, 2 once it was critical
        for kind, topic in ((LaserScan, 'raw_scan'), (Imu, 'imu/data'),
                            (BatteryState, 'battery/state')):
            self.create_subscription(
                kind, topic, partial(self.heard.__setitem__, kind), SENSOR_QOS)
        self.fused = self.create_publisher(SensorFusionData, 'sensor_fusion_data', 1)
        self.distance = self.create_publisher(Float32, 'obstacle_distance', 1)
        self.create_timer(1.0 / self.settings['fusion_frequency'], self.fuse)

    def take_parameters(self, parameters):
        for parameter in parameters:
            if parameter.name in DEFAULTS and not 0.0 < parameter.value < math.inf:
                return SetParametersResult(successful=False, reason='must be above zero')
            self.settings[parameter.name] = parameter.value
        return SetParametersResult(successful=True)

    async def fuse(self):
        percent = 100.0
        if BatteryState in self.heard:
            percent = clamp(100.0 * self.heard[BatteryState].percentage, 0.0, 100.0)
            self.watch(percent)
        if LaserScan not in self.heard:
            return
        fused = SensorFusionData(
            closest_obstacle_distance=closest_reading(self.heard[LaserScan]),
            battery_level=percent)
        if Imu in self.heard:
            fused.linear_acceleration = self.heard[Imu].linear_acceleration
            fused.angular_velocity = self.heard[Imu].angular_velocity
        fused.header.stamp = self.get_clock().now().to_msg()
        fused.header.frame_id = 'base_link'
        self.fused.publish(fused)
        self.distance.publish(Float32(data=fused.closest_obstacle_distance))

    def watch(self, percent):
        if percent < self.settings['battery_low_threshold'] and self.worst < 1:
            self.worst = 1
            self.get_logger().warning(f'battery at {percent:.1f} %')
        if percent < self.settings['battery_critical_threshold'] and self.worst < 2:
            self.worst = 2
            self.get_logger().error(f'battery at {percent:.1f} %')


if __name__ == '__main__':
    spin(SensorProcessor)
