"""Drive through a hall on request, and stop before its end."""

import math
import signal
from threading import Event
from typing import Optional

from geometry_msgs.msg import Twist
from rcl_interfaces.msg import SetParametersResult
import rclpy
from rclpy.duration import Duration
from rclpy.exceptions import ParameterException
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import qos_profile_sensor_data
from rclpy.signals import SignalHandlerOptions
from sensor_msgs.msg import LaserScan
from std_srvs.srv import SetBool

PERIOD_S = 0.1  # of the control loop
SECTOR = math.radians(30.0)  # what lies within, to each side, is ahead
DEFAULTS = {'patrol_speed': 0.25, 'stop_distance': 0.75}
WAKE_UP_S = 0.1  # wall time: a signal is seen no later than this
LAST_WORD_S = 0.2  # wall time the last command gets to reach the robot


def distance_ahead(scan: LaserScan) -> float:
    """Return the closest valid reading ahead in metres, inf where there is none."""
    found = math.inf
    for beam, distance in enumerate(scan.ranges):
        angle = math.remainder(scan.angle_min + beam * scan.angle_increment, math.tau)
        if abs(angle) <= SECTOR and scan.range_min <= distance <= scan.range_max:
            found = min(found, distance)
    return found


def refusal(parameters: list[Parameter]) -> str:
    """Return why these values are not accepted, empty if they are."""
    for parameter in parameters:
        if parameter.name in DEFAULTS and not 0.0 < parameter.value < math.inf:
            return f'{parameter.name} must be above 0, not {parameter.value}'
    return ''


class Guard(Node):
    """
    Drive straight on while on patrol, as long as the way ahead is free.

    Subscribes: `scan` (sensor_msgs/LaserScan), best effort.
    Publishes: `cmd_vel` (geometry_msgs/Twist) at 10 Hz.
    Services: `patrol` (std_srvs/SetBool).
    Parameters: `patrol_speed` in m/s, `stop_distance` in m.
    """

    def __init__(self, **node_options: object) -> None:
        super().__init__('guard', **node_options)
        self.add_on_set_parameters_callback(self._check)
        for name, default in DEFAULTS.items():
            self.declare_parameter(name, default)
        self._on_patrol = False
        self._ahead = 0.0  # nothing is known before the first scan
        self._cmd_vel = self.create_publisher(Twist, 'cmd_vel', 10)
        self.create_subscription(LaserScan, 'scan', self._on_scan, qos_profile_sensor_data)
        self.create_service(SetBool, 'patrol', self._on_request)
        self.create_timer(PERIOD_S, self._control)

    def _check(self, parameters: list[Parameter]) -> SetParametersResult:
        reason = refusal(parameters)
        return SetParametersResult(successful=not reason, reason=reason)

    def _on_scan(self, scan: LaserScan) -> None:
        self._ahead = distance_ahead(scan)

    def _on_request(
            self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        self._on_patrol = request.data
        response.success = True
        response.message = 'on patrol' if request.data else 'off patrol'
        return response

    def _control(self) -> None:
        free = self._ahead > self.get_parameter('stop_distance').value
        driving = self._on_patrol and free
        self._publish(self.get_parameter('patrol_speed').value if driving else 0.0)

    def _publish(self, speed: float) -> None:
        twist = Twist()
        twist.linear.x = speed
        self._cmd_vel.publish(twist)

    def stop(self) -> None:
        """Command a standstill and give the message time to leave."""
        self._publish(0.0)
        self._cmd_vel.wait_for_all_acked(Duration(seconds=LAST_WORD_S))


def main(args: Optional[list[str]] = None) -> int:
    """Serve the node until Ctrl-C or SIGTERM; return the exit code."""
    asked_to_stop = Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: asked_to_stop.set())
    rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
    try:
        node = Guard()
        executor = SingleThreadedExecutor()
        executor.add_node(node)
        while not asked_to_stop.is_set():
            executor.spin_once(timeout_sec=WAKE_UP_S)
        node.stop()
        executor.shutdown()
        node.destroy_node()
    except ParameterException as error:
        rclpy.logging.get_logger('startup').fatal(str(error))
        return 1
    finally:
        rclpy.try_shutdown()
    return 0
