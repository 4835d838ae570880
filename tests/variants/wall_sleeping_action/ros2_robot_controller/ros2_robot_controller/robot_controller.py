"""Drive a robot; the action's callback is one plain loop that sleeps between its steps."""

import math
import threading
import time

from geometry_msgs.msg import Pose, Twist
from nav_msgs.msg import Odometry
from rcl_interfaces.msg import SetParametersResult
import rclpy
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import MultiThreadedExecutor
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from rclpy.signals import SignalHandlerOptions
from ros2_robot_controller.action import NavigateToPosition
from ros2_robot_controller.srv import GetRobotStatus, SetSpeed
from ros2_robot_controller.utils.conversions import clamp, normalize_angle, yaw_from_quaternion
from sensor_msgs.msg import LaserScan

STEP_S = 0.05  # of the action's loop
DEFAULTS = {
    'max_linear_speed': 0.5, 'max_angular_speed': 1.0, 'linear_acceleration': 1.0,
    'angular_acceleration': 2.0, 'laser_processing_rate': 10.0, 'fusion_rate': 20.0,
    'obstacle_detection_threshold': 0.5, 'emergency_stop_distance': 0.2, 'safety_margin': 0.3,
}


class RobotController(Node):
    """While a goal is under way its loop alone publishes; the control timer keeps quiet."""

    def __init__(self):
        super().__init__('robot_controller')
        self.add_on_set_parameters_callback(self.check)
        self.declare_parameter('robot_name', 'turtlebot4')
        for name, default in DEFAULTS.items():
            self.declare_parameter(name, default)
        self.lock = threading.Lock()
        self.speed = 0.0
        self.v = self.omega = 0.0  # the last command
        self.sectors = {'ahead': math.inf, 'behind': math.inf, 'anywhere': math.inf}
        self.pose = Pose()
        self.navigating = False
        self.running = True
        group = ReentrantCallbackGroup()
        self.publisher = self.create_publisher(Twist, 'cmd_vel', 10)
        self.create_subscription(LaserScan, 'scan', self.on_scan, qos_profile_sensor_data,
                                 callback_group=group)
        self.create_subscription(Odometry, 'odom', self.on_odom, qos_profile_sensor_data,
                                 callback_group=group)
        self.create_service(SetSpeed, 'set_speed', self.on_set_speed, callback_group=group)
        self.create_service(GetRobotStatus, 'get_status', self.on_status, callback_group=group)
        self.server = ActionServer(
            self, NavigateToPosition, 'navigate_to_position', self.navigate,
            goal_callback=self.on_goal, cancel_callback=lambda _: CancelResponse.ACCEPT,
            callback_group=group)
        self.period = 1.0 / self.value('laser_processing_rate')
        self.create_timer(self.period, self.control, callback_group=group)

    def value(self, name):
        return self.get_parameter(name).value

    def check(self, parameters):
        for parameter in parameters:
            if parameter.name not in DEFAULTS:
                continue
            lowest = 0.01 if 'rate' in parameter.name or 'acceler' in parameter.name else 0.0
            if not lowest <= parameter.value < math.inf:
                return SetParametersResult(
                    successful=False, reason=f'{parameter.name} {parameter.value} makes no sense')
        return SetParametersResult(successful=True)

    def on_scan(self, scan):
        found = {'ahead': math.inf, 'behind': math.inf, 'anywhere': math.inf}
        for i, distance in enumerate(scan.ranges):
            if math.isfinite(distance) and scan.range_min <= distance <= scan.range_max:
                cosine = math.cos(scan.angle_min + i * scan.angle_increment)
                sector = 'ahead' if cosine >= 0.5 else 'behind' if cosine <= -0.5 else 'anywhere'
                found[sector] = min(found[sector], distance)
                found['anywhere'] = min(found['anywhere'], distance)
        self.sectors = found

    def on_odom(self, odom):
        self.pose = odom.pose.pose

    def obstacle(self, v):
        sectors = self.sectors
        near = sectors['behind' if v < 0.0 else 'ahead']
        return (near < self.value('obstacle_detection_threshold')
                or sectors['anywhere'] < self.value('emergency_stop_distance'))

    def on_set_speed(self, request, response):
        limit = self.value('max_linear_speed')
        response.success = abs(request.speed) <= limit + 1e-6  # false for NaN
        if response.success:
            self.speed = clamp(request.speed, -limit, limit)
            response.message = f'Speed is now {request.speed:.2f} m/s'
        else:
            response.message = f'{request.speed} is not within +-{limit} m/s'
        return response

    def on_status(self, _, response):
        response.speed = self.speed
        response.pose = self.pose
        response.obstacle_detected = self.obstacle(0.0 if self.navigating else self.speed)
        response.status = 'OBSTACLE_DETECTED' if response.obstacle_detected else 'ACTIVE'
        return response

    def control(self):
        if not self.navigating:
            self.drive(self.speed, 0.0, self.period)

    def drive(self, v, omega, dt):
        """Publish a command as near to (v, omega) as obstacles, limits and ramps allow."""
        if v != 0.0 and self.obstacle(v):
            v = 0.0
        if self.sectors['anywhere'] < self.value('emergency_stop_distance'):
            v = omega = 0.0
        top, fastest = self.value('max_linear_speed'), self.value('max_angular_speed')
        with self.lock:
            if not self.running:
                v = omega = 0.0
            self.v = slope(self.v, clamp(v, -top, top), self.value('linear_acceleration') * dt)
            self.omega = slope(self.omega, clamp(omega, -fastest, fastest),
                               self.value('angular_acceleration') * dt)
            twist = Twist()
            twist.linear.x, twist.angular.z = self.v, self.omega
            self.publisher.publish(twist)

    def on_goal(self, goal):
        place = goal.target_pose.position
        fine = math.isfinite(place.x) and math.isfinite(place.y) and goal.tolerance > 0.0
        return GoalResponse.ACCEPT if fine and not self.navigating else GoalResponse.REJECT

    def navigate(self, handle):
        self.navigating = True
        self.speed = 0.0
        target, tolerance = handle.request.target_pose.position, handle.request.tolerance
        feedback = NavigateToPosition.Feedback()
        arrived = False
        while self.running and not handle.is_cancel_requested:
            pose = self.pose
            dx, dy = target.x - pose.position.x, target.y - pose.position.y
            distance = math.hypot(dx, dy)
            feedback.distance_remaining = distance
            handle.publish_feedback(feedback)
            if distance < 0.7 * tolerance:
                arrived = True
                break
            error = normalize_angle(math.atan2(dy, dx) - yaw_from_quaternion(pose.orientation))
            v = 0.8 * distance * max(0.0, math.cos(error)) ** 3
            self.drive(v, 2.0 * error, STEP_S)
            time.sleep(STEP_S)
        self.drive(0.0, 0.0, STEP_S)
        self.navigating = False
        if arrived:
            handle.succeed()
        elif handle.is_cancel_requested:
            handle.canceled()
        elif self.running:
            handle.abort()
        return NavigateToPosition.Result(success=arrived, final_pose=self.pose)


def slope(old, new, rise):
    """Return the next value on the way from old to new; slowing down is free."""
    if old * new < 0.0:
        return 0.0
    return clamp(new, -abs(old) - rise, abs(old) + rise)


def main():
    """Spin until Ctrl-C."""
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    node = RobotController()
    executor = MultiThreadedExecutor(num_threads=3)
    executor.add_node(node)
    try:
        executor.spin()
    except KeyboardInterrupt:
        node.running = False
        node.drive(0.0, 0.0, STEP_S)
        time.sleep(3 * STEP_S)  # let the action's loop see it, and the command out
    node.destroy_node()
    rclpy.try_shutdown()
