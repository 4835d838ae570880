#!/usr/bin/env python3
"""The node between a course package and a TurtleBot 4: it stamps the commands and turns the scans."""

from __future__ import annotations

from typing import Any

import rclpy
from geometry_msgs.msg import Twist, TwistStamped
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import LaserScan

FRAME = "base_link"


class Adapter(Node):
    """Pass commands to the robot with a header, and its scans to the package with their angles from straight ahead.

    Subscribes: `cmd_vel` (geometry_msgs/Twist), `robot/scan` (sensor_msgs/LaserScan, best effort).
    Publishes: `robot/cmd_vel` (geometry_msgs/TwistStamped), `scan` (sensor_msgs/LaserScan).
    Parameters: `laser_yaw`, 0.0: how far the lidar is turned to the left on the robot, in rad.

    It sends nothing of its own: when the package falls silent, so does this node, and the base stops.
    """

    def __init__(self, **node_options: Any) -> None:
        super().__init__("turtlebot4_adapter", **node_options)
        self.declare_parameter("laser_yaw", 0.0)
        self._commands = self.create_publisher(TwistStamped, "robot/cmd_vel", 10)
        self._scans = self.create_publisher(LaserScan, "scan", 10)  # reliable: any subscriber hears it
        self.create_subscription(Twist, "cmd_vel", self._stamp, 10)
        self.create_subscription(LaserScan, "robot/scan", self._turn, qos_profile_sensor_data)

    def _stamp(self, command: Twist) -> None:
        stamped = TwistStamped(twist=command)
        stamped.header.stamp = self.get_clock().now().to_msg()
        stamped.header.frame_id = FRAME
        self._commands.publish(stamped)

    def _turn(self, scan: LaserScan) -> None:
        yaw = self.get_parameter("laser_yaw").value
        scan.angle_min += yaw
        scan.angle_max += yaw
        scan.header.frame_id = FRAME  # by its direction; its origin stays where the lidar is
        self._scans.publish(scan)


def main() -> None:
    """Run the node until Ctrl-C."""
    rclpy.init()
    try:
        rclpy.spin(Adapter())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
