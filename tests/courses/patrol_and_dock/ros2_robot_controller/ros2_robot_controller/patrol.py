"""Patrol a list of places, and dock when the battery is low."""

import math
from typing import Any, Optional

from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
import numpy as np
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from ros2_robot_controller.chart import Chart, Point
from sensor_msgs.msg import BatteryState, LaserScan

PERIOD = 0.1  # s, of the control loop
MAX_V, MAX_OMEGA = 0.45, 1.2  # m/s, rad/s
TURN_GAIN = 2.0  # rad/s per rad
FACING = 0.5  # rad: turn in place until the next point is this near to straight ahead
AHEAD = 0.5  # m: how far along the way the robot aims
SEEN = 6.0  # m: farther readings are too rough for the chart
STOP = 0.35  # m from the lidar to what lies ahead: do not drive on
VISITED = 0.12  # m
DOCKED, ALIGNED = 0.02, 0.03  # m, rad


class Patrol(Node):
    """
    Drive from place to place, or to the dock, on ways around what the lidar has seen.

    Subscribes: `scan`, `odom`, `battery/state`, all best effort. Publishes: `cmd_vel` at 10 Hz.
    Parameters: `places` (x and y of each), `dock` (x, y, heading), `battery_low` in percent.
    """

    def __init__(self, **node_options: Any) -> None:
        super().__init__('patrol', **node_options)
        numbers = self.declare_parameter('places', [0.0, 0.0]).value
        self._places = list(zip(numbers[::2], numbers[1::2]))
        self._dock = self.declare_parameter('dock', [0.0, 0.0, 0.0]).value
        self.declare_parameter('battery_low', 20.0)
        self._next = 0
        self._charge = 100.0
        self._pose: Optional[tuple[float, float, float]] = None
        self._chart: Optional[Chart] = None
        self._ahead = 0.0  # nothing is known before the first scan
        self._way: list[Point] = []
        self._docking = False
        self._standing = False
        self._cmd_vel = self.create_publisher(Twist, 'cmd_vel', 10)
        self.create_subscription(Odometry, 'odom', self._on_odom, qos_profile_sensor_data)
        self.create_subscription(LaserScan, 'scan', self._on_scan, qos_profile_sensor_data)
        self.create_subscription(
            BatteryState, 'battery/state', self._on_battery, qos_profile_sensor_data)
        self.create_timer(PERIOD, self._control)

    # Sensors

    def _on_odom(self, odom: Odometry) -> None:
        q, place = odom.pose.pose.orientation, odom.pose.pose.position
        self._pose = place.x, place.y, 2.0 * math.atan2(q.z, q.w)
        if self._chart is None:
            self._chart = Chart(place.x, place.y)

    def _on_battery(self, battery: BatteryState) -> None:
        self._charge = battery.percentage * 100.0

    def _on_scan(self, scan: LaserScan) -> None:
        ranges = np.array(scan.ranges)
        angles = scan.angle_min + scan.angle_increment * np.arange(len(ranges))
        valid = (ranges >= scan.range_min) & (ranges <= min(scan.range_max, SEEN))
        ranges, angles = ranges[valid], angles[valid]
        in_the_way = (np.cos(angles) > 0.0) & (np.abs(ranges * np.sin(angles)) < 0.2)
        self._ahead = float(ranges[in_the_way].min(initial=math.inf))
        if self._chart is None or self._pose is None:
            return
        x, y, yaw = self._pose
        self._chart.add(
            x + ranges * np.cos(yaw + angles), y + ranges * np.sin(yaw + angles))

    # Decisions

    def _control(self) -> None:
        twist = Twist()
        if self._pose is not None and self._chart is not None:
            twist.linear.x, twist.angular.z = self._wanted()
        self._cmd_vel.publish(twist)

    def _wanted(self) -> tuple[float, float]:
        """Return the speed and the rate of turn to command."""
        low = self._charge < self.get_parameter('battery_low').value
        if low != self._docking:
            self._docking, self._standing, self._way = low, False, []
        if self._docking and (self._standing or self._left(self._dock[:2]) <= DOCKED):
            self._standing = True
            return 0.0, self._align()
        if not self._docking and self._left(self._places[self._next]) <= VISITED:
            self._next = (self._next + 1) % len(self._places)
            self._way = []
        return self._along_the_way()

    def _align(self) -> float:
        error = math.remainder(self._dock[2] - self._pose[2], math.tau)
        return 0.0 if abs(error) <= ALIGNED else limited(TURN_GAIN * error, MAX_OMEGA)

    def _along_the_way(self) -> tuple[float, float]:
        place = tuple(self._dock[:2]) if self._docking else self._places[self._next]
        self._shorten()
        if not self._way or not self._chart.is_free(self._way[:-1]):
            found = self._chart.way(self._pose[:2], place)
            if found is None and not self._docking:  # nothing leads there: go on with the next
                self._next = (self._next + 1) % len(self._places)
            self._way = found or []
        if not self._way:
            return 0.0, 0.0
        x, y, yaw = self._pose
        aim = next((p for p in self._way if math.dist(p, (x, y)) >= AHEAD), self._way[-1])
        error = math.remainder(math.atan2(aim[1] - y, aim[0] - x) - yaw, math.tau)
        omega = limited(TURN_GAIN * error, MAX_OMEGA)
        if abs(error) > FACING or self._ahead < STOP:
            return 0.0, omega
        return min(MAX_V, max(0.05, self._left(place))), omega

    def _shorten(self) -> None:
        """Drop the part of the way that lies behind the robot."""
        if self._way:
            nearest = min(range(len(self._way)), key=lambda i: self._left(self._way[i]))
            self._way = self._way[nearest:]

    def _left(self, place: Point) -> float:
        return math.dist(place, self._pose[:2])


def limited(value: float, most: float) -> float:
    """Return the value, or the nearer of -most and most."""
    return min(max(value, -most), most)


def main(args: Optional[list[str]] = None) -> int:
    """Serve the node until Ctrl-C; return the exit code."""
    rclpy.init(args=args)
    try:
        rclpy.spin(Patrol())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()
    return 0
