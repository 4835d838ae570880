"""The smallest useful controller: it subscribes to scan and odom and publishes a command ten times a second.

    python -m benchmarks.smallest_node single|multi [--ros-args ...]

It runs in a SingleThreadedExecutor, or in a MultiThreadedExecutor with the default number of threads. Lockstep with
this node shows the cost of ROS and of the barrier; a larger node adds only its own.
"""

from __future__ import annotations

import sys

import rclpy
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor, SingleThreadedExecutor
from rclpy.node import Node
from sensor_msgs.msg import LaserScan

NAME = "robot_controller"


class SmallestController(Node):
    """Subscribes to scan and odom, publishes cmd_vel at 10 Hz of node time: straight ahead, stop near obstacles."""

    def __init__(self) -> None:
        super().__init__(NAME, parameter_overrides=[rclpy.Parameter("use_sim_time", value=True)])
        self._closest = 0.0
        self._publisher = self.create_publisher(Twist, "cmd_vel", 10)
        self.create_subscription(LaserScan, "scan", self._take_scan, 10)
        self.create_subscription(Odometry, "odom", lambda _message: None, 10)
        self.create_timer(0.1, self._control)

    def _take_scan(self, scan: LaserScan) -> None:
        self._closest = min(scan.ranges)

    def _control(self) -> None:
        twist = Twist()
        twist.linear.x = 0.25 if self._closest > 0.5 else 0.0
        self._publisher.publish(twist)


def main() -> None:
    """Run the node until it is stopped."""
    rclpy.init()
    executor = MultiThreadedExecutor() if sys.argv[1] == "multi" else SingleThreadedExecutor()
    executor.add_node(SmallestController())
    try:
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
