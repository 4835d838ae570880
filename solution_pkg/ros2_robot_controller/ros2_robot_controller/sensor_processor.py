"""The node that fuses the sensors into one message. It watches; it moves nothing."""

import math
from typing import Any, Optional

from geometry_msgs.msg import Vector3
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import qos_profile_sensor_data
from ros2_robot_controller.msg import SensorFusionData
from ros2_robot_controller.utils import settings
from ros2_robot_controller.utils.conversions import clamp
from ros2_robot_controller.utils.running import run
from ros2_robot_controller.utils.scans import closest_reading
from sensor_msgs.msg import BatteryState, Imu, LaserScan
from std_msgs.msg import Float32

FULL_PERCENT = 100.0  # also what a battery counts as that has not reported yet
HYSTERESIS_PERCENT = 2.0  # rise by this much before the same alarm can sound again

SETTINGS = {
    'fusion_frequency': settings.rate(20.0),
    'battery_low_threshold': settings.percentage(20.0),
    'battery_critical_threshold': settings.percentage(10.0),
}


def battery_percent(percentage: float, previous: float) -> float:
    """
    Return a BatteryState's percentage, which is 0 to 1, in percent, 0 to 100.

    A battery that cannot measure reports NaN and keeps the previous percentage.
    """
    if math.isnan(percentage):
        return previous
    return clamp(FULL_PERCENT * percentage, 0.0, FULL_PERCENT)


def alarm_state(was_on: bool, percent: float, threshold: float) -> bool:
    """Return whether the alarm is on: from below the threshold until well above it again."""
    if percent < threshold:
        return True
    return was_on and percent < threshold + HYSTERESIS_PERCENT


class SensorProcessor(Node):
    """
    Publish what the sensors say together, once a scan has been seen.

    Subscribes: `raw_scan` (sensor_msgs/LaserScan), `imu/data` (sensor_msgs/Imu),
    `battery/state` (sensor_msgs/BatteryState), all best effort.
    Publishes at `fusion_frequency`: `sensor_fusion_data` (SensorFusionData, frame base_link) and
    `obstacle_distance` (std_msgs/Float32, metres, inf for nothing in range).
    Parameters: see SETTINGS. All of them may change while the node runs.
    """

    def __init__(self, **node_options: Any) -> None:
        super().__init__('sensor_processor', **node_options)
        settings.declare(self, SETTINGS)

        self._closest: Optional[float] = None  # metres; None until the first scan
        self._battery = FULL_PERCENT
        self._battery_low = False
        self._battery_critical = False
        self._acceleration = Vector3()
        self._angular_velocity = Vector3()

        self._fused = self.create_publisher(SensorFusionData, 'sensor_fusion_data', 10)
        self._distance = self.create_publisher(Float32, 'obstacle_distance', 10)
        for message_type, topic, callback in (
                (LaserScan, 'raw_scan', self._on_scan),
                (Imu, 'imu/data', self._on_imu),
                (BatteryState, 'battery/state', self._on_battery)):
            self.create_subscription(message_type, topic, callback, qos_profile_sensor_data)
        self._timer = self.create_timer(self._period(), self._fuse)
        self.add_post_set_parameters_callback(self._on_parameters_changed)

    def _value(self, parameter: str) -> Any:
        return self.get_parameter(parameter).value

    def _period(self) -> float:
        return 1.0 / self._value('fusion_frequency')

    def _on_scan(self, scan: LaserScan) -> None:
        self._closest = closest_reading(scan)

    def _on_imu(self, imu: Imu) -> None:
        self._acceleration = imu.linear_acceleration
        self._angular_velocity = imu.angular_velocity

    def _on_battery(self, battery: BatteryState) -> None:
        self._battery = percent = battery_percent(battery.percentage, self._battery)
        low = alarm_state(self._battery_low, percent, self._value('battery_low_threshold'))
        critical = alarm_state(self._battery_critical, percent,
                               self._value('battery_critical_threshold'))
        if low and not self._battery_low:
            self.get_logger().warning(f'Battery low: {percent:.0f} %')
        if critical and not self._battery_critical:
            self.get_logger().error(f'Battery critical: {percent:.0f} %')
        self._battery_low, self._battery_critical = low, critical

    def _fuse(self) -> None:
        if self._closest is None:
            return
        fused = SensorFusionData()
        fused.header.stamp = self.get_clock().now().to_msg()
        fused.header.frame_id = 'base_link'
        fused.closest_obstacle_distance = self._closest
        fused.battery_level = self._battery
        fused.linear_acceleration = self._acceleration
        fused.angular_velocity = self._angular_velocity
        self._fused.publish(fused)
        self._distance.publish(Float32(data=self._closest))

    def _on_parameters_changed(self, parameters: list[Parameter]) -> None:
        # A timer keeps the period it was made with.
        if any(parameter.name == 'fusion_frequency' for parameter in parameters):
            self.destroy_timer(self._timer)
            self._timer = self.create_timer(self._period(), self._fuse)


def main(args: Optional[list[str]] = None) -> int:
    """Run the node until Ctrl-C; return the exit code."""
    return run(SensorProcessor, args)
