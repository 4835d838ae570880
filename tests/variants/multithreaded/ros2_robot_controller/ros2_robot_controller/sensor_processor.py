"""Fuse the sensors with many threads; a lock guards the latest readings."""

from threading import Lock

import rclpy
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.exceptions import ParameterException
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from ros2_robot_controller.msg import SensorFusionData
from ros2_robot_controller.utils import settings
from ros2_robot_controller.utils.scans import closest_reading
from sensor_msgs.msg import BatteryState, Imu, LaserScan
from std_msgs.msg import Float32

SETTINGS = {
    'fusion_frequency': settings.rate(20.0),
    'battery_low_threshold': settings.percentage(20.0),
    'battery_critical_threshold': settings.percentage(10.0),
}


class SensorProcessor(Node):
    """Fill one message as the sensors speak; publish copies of it at the fusion frequency."""

    def __init__(self) -> None:
        super().__init__('sensor_processor')
        settings.declare(self, SETTINGS)
        self._lock = Lock()
        self._data = SensorFusionData(battery_level=100.0)
        self._data.header.frame_id = 'base_link'
        self._seen_scan = False
        self._warned = set()
        group = ReentrantCallbackGroup()
        self._fused = self.create_publisher(SensorFusionData, 'sensor_fusion_data', 10)
        self._distance = self.create_publisher(Float32, 'obstacle_distance', 10)
        for kind, topic, callback in ((LaserScan, 'raw_scan', self._scan),
                                      (Imu, 'imu/data', self._imu),
                                      (BatteryState, 'battery/state', self._battery)):
            self.create_subscription(kind, topic, callback, qos_profile_sensor_data,
                                     callback_group=group)
        period = 1.0 / self.get_parameter('fusion_frequency').value
        self.create_timer(period, self._publish, callback_group=group)

    def _scan(self, scan: LaserScan) -> None:
        closest = closest_reading(scan)
        with self._lock:
            self._data.closest_obstacle_distance = closest
            self._seen_scan = True

    def _imu(self, imu: Imu) -> None:
        with self._lock:
            self._data.linear_acceleration = imu.linear_acceleration
            self._data.angular_velocity = imu.angular_velocity

    def _battery(self, battery: BatteryState) -> None:
        percent = min(100.0, max(0.0, 100.0 * battery.percentage))
        with self._lock:
            self._data.battery_level = percent
        if self._falls_below('low', percent):
            self.get_logger().warning(f'Battery low: {percent:.0f} %')
        if self._falls_below('critical', percent):
            self.get_logger().error(f'Battery critical: {percent:.0f} %')

    def _falls_below(self, name: str, percent: float) -> bool:
        if percent >= self.get_parameter(f'battery_{name}_threshold').value:
            self._warned.discard(name)
            return False
        if name in self._warned:
            return False
        self._warned.add(name)
        return True

    def _publish(self) -> None:
        with self._lock:
            if not self._seen_scan:
                return
            self._data.header.stamp = self.get_clock().now().to_msg()
            self._fused.publish(self._data)
            self._distance.publish(Float32(data=self._data.closest_obstacle_distance))


def main(args=None) -> None:
    """Spin until Ctrl-C."""
    rclpy.init(args=args)
    try:
        node = SensorProcessor()
        executor = MultiThreadedExecutor()
        executor.add_node(node)
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except ParameterException as error:
        raise SystemExit(str(error)) from error
    finally:
        rclpy.try_shutdown()


if __name__ == '__main__':
    main()
