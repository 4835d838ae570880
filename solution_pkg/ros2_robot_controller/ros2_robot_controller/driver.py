"""The robot's reflexes: drive at the speed in force, and never into anything."""

from dataclasses import fields
import math
from typing import Any

from geometry_msgs.msg import Pose, Twist
from nav_msgs.msg import Odometry
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from rclpy.time import Time
from ros2_robot_controller.utils import motion, settings
from ros2_robot_controller.utils.conversions import clamp, yaw_from_quaternion
from ros2_robot_controller.utils.motion import Command, Limits, STOP
from ros2_robot_controller.utils.scans import measure_proximity, Proximity
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Header

NEVER = -math.inf  # the time of what has not happened yet
STALE_S = 0.5  # node time; older scans and odometry tell nothing: five missed ones at 10 Hz
MAX_DT_PERIODS = 2.0  # a late control step speeds up by no more than this many steps' worth
LAST_WORD_S = 0.2  # wall time the last command gets to reach the robot

SETTINGS = {
    'robot_name': settings.name('turtlebot4'),
    'max_linear_speed': settings.at_least_zero(0.5),
    'max_angular_speed': settings.at_least_zero(1.0),
    'linear_acceleration': settings.above_zero(1.0),
    'angular_acceleration': settings.above_zero(2.0),
    'laser_processing_rate': settings.rate(10.0),
    'fusion_rate': settings.rate(20.0),
    'obstacle_detection_threshold': settings.at_least_zero(0.5),
    'emergency_stop_distance': settings.at_least_zero(0.2),
    'safety_margin': settings.at_least_zero(0.3),
}


class Driver(Node):
    """
    Drive at the speed in force, which is 0 until a layer above sets another.

    Subscribes: `scan` (sensor_msgs/LaserScan), `odom` (nav_msgs/Odometry), both best effort.
    Publishes: `cmd_vel` (geometry_msgs/Twist) at `laser_processing_rate`, and a stop at once.
    Parameters: see SETTINGS; they are those of all layers.

    The robot stands still while it has no scan younger than STALE_S. A layer above may want
    another command than straight on: it overrides `_wanted`, and what is safe stays decided here.
    """

    def __init__(self, **node_options: Any) -> None:
        super().__init__('robot_controller', **node_options)
        settings.declare(self, SETTINGS)

        self._speed = 0.0  # the speed in force, m/s
        self._near = Proximity()
        self._scan_time = NEVER
        self._pose = Pose()
        self._odom_time = NEVER
        self._last_command = STOP
        self._last_command_time = self._now()

        self._cmd_vel = self.create_publisher(Twist, 'cmd_vel', 10)
        self.create_subscription(LaserScan, 'scan', self._on_scan, qos_profile_sensor_data)
        self.create_subscription(Odometry, 'odom', self._on_odom, qos_profile_sensor_data)
        self._control_timer = self.create_timer(self._period('laser_processing_rate'),
                                                self._control)

    # Values that change over time

    def _now(self) -> float:
        return self.get_clock().now().nanoseconds * 1e-9

    def _value(self, parameter: str) -> Any:
        return self.get_parameter(parameter).value

    def _period(self, rate: str) -> float:
        return 1.0 / self._value(rate)

    def _limits(self) -> Limits:
        return Limits(**{limit.name: self._value(limit.name) for limit in fields(Limits)})

    def _is_fresh(self, time: float) -> bool:
        return abs(self._now() - time) <= STALE_S  # far ahead: the clock was set back

    # Sensors

    def _measured(self, header: Header) -> float:
        return Time.from_msg(header.stamp).nanoseconds * 1e-9

    def _on_scan(self, scan: LaserScan) -> None:
        self._near = measure_proximity(scan)
        self._scan_time = self._measured(scan.header)
        # Do not let a stop wait for the next control step.
        if motion.make_safe(self._last_command, self._near, self._limits()) == STOP:
            if self._last_command != STOP:
                self._publish(STOP)

    def _on_odom(self, odom: Odometry) -> None:
        pose = odom.pose.pose
        yaw = yaw_from_quaternion(pose.orientation)
        if math.isfinite(pose.position.x + pose.position.y + yaw):
            self._pose, self._odom_time = pose, self._measured(odom.header)

    # The control loop

    def _control(self) -> None:
        limits = self._limits()
        wanted = self._wanted(limits) if self._is_fresh(self._scan_time) else STOP
        safe = motion.make_safe(wanted, self._near, limits)
        period = self._period('laser_processing_rate')
        dt = clamp(self._now() - self._last_command_time, 0.0, MAX_DT_PERIODS * period)
        self._publish(motion.speed_up_gently(self._last_command, safe, dt, limits))

    def _wanted(self, limits: Limits) -> Command:
        return Command(v=self._speed)

    def _publish(self, command: Command) -> None:
        twist = Twist()
        twist.linear.x = command.v
        twist.angular.z = command.omega
        self._cmd_vel.publish(twist)
        self._last_command = command
        self._last_command_time = self._now()

    def stop(self) -> None:
        """Command a standstill and give the message time to leave."""
        self._publish(STOP)
        self._cmd_vel.wait_for_all_acked(Duration(seconds=LAST_WORD_S))
