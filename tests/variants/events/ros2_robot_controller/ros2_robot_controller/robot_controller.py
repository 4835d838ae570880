#!/usr/bin/env python3
"""Drive a robot from events: small callbacks around one dictionary of what is known."""

from functools import partial
import math
import signal
import sys

from geometry_msgs.msg import Pose, Twist
from nav_msgs.msg import Odometry
from rcl_interfaces.msg import SetParametersResult
import rclpy
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.exceptions import InvalidParameterValueException
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.signals import SignalHandlerOptions
from rclpy.task import Future
from ros2_robot_controller.action import NavigateToPosition
from ros2_robot_controller.srv import GetRobotStatus, SetSpeed
from ros2_robot_controller.utils.conversions import clamp, normalize_angle, yaw_from_quaternion
from ros2_robot_controller.utils.scans import measure_proximity, Proximity
from sensor_msgs.msg import LaserScan

SENSOR_QOS = QoSProfile(
    history=HistoryPolicy.KEEP_LAST, depth=1, reliability=ReliabilityPolicy.BEST_EFFORT,
    durability=DurabilityPolicy.VOLATILE)
COMMAND_QOS = QoSProfile(depth=5, reliability=ReliabilityPolicy.RELIABLE)
DEFAULTS = {
    'robot_name': 'turtlebot4', 'max_linear_speed': 0.5, 'max_angular_speed': 1.0,
    'linear_acceleration': 1.0, 'angular_acceleration': 2.0, 'laser_processing_rate': 10.0,
    'fusion_rate': 20.0, 'obstacle_detection_threshold': 0.5, 'emergency_stop_distance': 0.2,
    'safety_margin': 0.3,
}
FEEDBACK_S = 0.25


def nonsense(parameter):
    """Return why a value cannot be meant, or nothing."""
    if not isinstance(parameter.value, float):
        return ''
    lowest = 1e-3 if parameter.name.endswith(('rate', 'acceleration')) else 0.0
    fine = math.isfinite(parameter.value) and parameter.value >= lowest
    return '' if fine else f'{parameter.name} = {parameter.value} makes no sense'


class RobotController(Node):
    """What is known stands in `now`, what is asked of the robot in `order`."""

    def __init__(self):
        super().__init__('robot_controller')
        self.settings = dict(DEFAULTS)
        self.add_on_set_parameters_callback(self.take_parameters)
        for name, default in DEFAULTS.items():
            self.settings[name] = self.declare_parameter(name, default).value
        self.now = {'near': Proximity(), 'pose': Pose()}
        self.order = {'speed': 0.0, 'goal': None}
        self.last = (0.0, 0.0)
        self.command = self.create_publisher(Twist, 'cmd_vel', COMMAND_QOS)
        self.create_subscription(
            LaserScan, 'scan', lambda scan: self.now.update(near=measure_proximity(scan)),
            SENSOR_QOS)
        self.create_subscription(
            Odometry, 'odom', lambda odom: self.now.update(pose=odom.pose.pose), SENSOR_QOS)
        self.create_service(SetSpeed, 'set_speed', partial(self.set_speed, limit=(
            lambda: self.settings['max_linear_speed'])))
        self.create_service(GetRobotStatus, 'get_status', self.status)
        self.server = ActionServer(
            self, NavigateToPosition, 'navigate_to_position', execute_callback=self.navigate,
            goal_callback=lambda goal: GoalResponse.ACCEPT if math.isfinite(
                goal.target_pose.position.x + goal.target_pose.position.y)
            and goal.tolerance > 0.0 else GoalResponse.REJECT,
            cancel_callback=self.cancel)
        self.dt = 1.0 / self.settings['laser_processing_rate']
        self.create_timer(self.dt, self.control)
        self.create_timer(FEEDBACK_S, self.feedback)

    def take_parameters(self, parameters):
        reason = next(filter(None, map(nonsense, parameters)), '')
        if not reason:
            self.settings.update((p.name, p.value) for p in parameters if p.name in DEFAULTS)
        return SetParametersResult(successful=not reason, reason=reason)

    def set_speed(self, request, response, limit):
        response.success = bool(abs(request.speed) <= limit() * 1.000001)
        if response.success:
            self.order['speed'] = request.speed
        response.message = 'ok' if response.success else f'above the limit of {limit()} m/s'
        return response

    def status(self, _, response):
        response.speed = self.order['speed']
        response.obstacle_detected = self.blocked(self.order['speed'])
        response.pose = self.now['pose']
        response.status = ['ACTIVE', 'OBSTACLE_DETECTED'][response.obstacle_detected]
        return response

    async def navigate(self, handle):
        if self.order['goal']:
            self.order['goal'][1].set_result('abort')
        over = Future()
        self.order['goal'] = (handle, over)
        how = await over
        self.order.update(goal=None, speed=0.0)
        self.send(0.0, 0.0)
        getattr(handle, how)()
        return NavigateToPosition.Result(success=how == 'succeed', final_pose=self.now['pose'])

    def cancel(self, handle):
        # The goal is not yet canceling here; the control timer sees it.
        goal = self.order['goal']
        return CancelResponse.ACCEPT if goal and goal[0] is handle else CancelResponse.REJECT

    def way(self, handle):
        """Return distance and direction to the goal, in metres and radians."""
        pose, target = self.now['pose'], handle.request.target_pose.position
        dx, dy = target.x - pose.position.x, target.y - pose.position.y
        turn = normalize_angle(math.atan2(dy, dx) - yaw_from_quaternion(pose.orientation))
        return math.hypot(dx, dy), turn

    async def control(self):
        if not self.order['goal']:
            self.drive(self.order['speed'], 0.0)
            return
        handle, over = self.order['goal']
        distance, turn = self.way(handle)
        if over.done():
            return
        if handle.is_cancel_requested:
            over.set_result('canceled')
        elif distance <= min(0.05, handle.request.tolerance):
            over.set_result('succeed')
        else:
            v = min(self.settings['max_linear_speed'], 0.9 * distance)
            self.drive(v if abs(turn) < 0.5 else 0.0, 1.8 * turn)

    async def feedback(self):
        if self.order['goal']:
            handle = self.order['goal'][0]
            handle.publish_feedback(
                NavigateToPosition.Feedback(distance_remaining=self.way(handle)[0]))

    def blocked(self, v):
        near = self.now['near']
        return ((near.behind if v < 0.0 else near.ahead)
                < self.settings['obstacle_detection_threshold']
                or near.anywhere < self.settings['emergency_stop_distance'])

    def drive(self, v, w):
        s, near = self.settings, self.now['near']
        if self.blocked(v):
            v = 0.0
        if near.anywhere < s['emergency_stop_distance']:
            w = 0.0
        room = (near.behind if v < 0.0 else near.ahead) - s['obstacle_detection_threshold']
        top = s['max_linear_speed'] * (0.4 if room < s['safety_margin'] else 1.0)
        v, w = clamp(v, -top, top), clamp(w, -s['max_angular_speed'], s['max_angular_speed'])
        self.send(self.ramp(self.last[0], v, s['linear_acceleration']),
                  self.ramp(self.last[1], w, s['angular_acceleration']))

    def ramp(self, old, new, acceleration):
        """Return `new`, or as near to it as one cycle allows."""
        old = old if old * new > 0.0 else 0.0
        return clamp(new, -abs(old) - acceleration * self.dt, abs(old) + acceleration * self.dt)

    def send(self, v, w):
        self.last = (v, w)
        twist = Twist()
        twist.linear.x, twist.angular.z = v, w
        self.command.publish(twist)


def spin(make_node, farewell=lambda node: None):
    """Spin a node in an EventsExecutor until SIGINT or SIGTERM."""
    going = [True]
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: going.clear())
    rclpy.init(args=sys.argv, signal_handler_options=SignalHandlerOptions.NO)
    try:
        node = make_node()
        executor = EventsExecutor()
        executor.add_node(node)
        while going:
            executor.spin_once(timeout_sec=0.1)
        farewell(node)
        executor.shutdown()
    except InvalidParameterValueException as error:
        sys.exit(str(error))
    finally:
        rclpy.try_shutdown()


def farewell(node):
    """Stop, and give the message time to leave."""
    node.send(0.0, 0.0)
    node.command.wait_for_all_acked(rclpy.duration.Duration(seconds=0.2))


if __name__ == '__main__':
    spin(RobotController, farewell)
