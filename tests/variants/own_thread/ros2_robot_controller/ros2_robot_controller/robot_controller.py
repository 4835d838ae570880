"""
The robot controller: one class, one state machine, one thread that sleeps on the node's clock.

rclpy spins in the main thread and only brings in data. The control thread wakes ten times a
second of the node's time, looks at the data, moves on in the state machine and publishes.
"""

from enum import auto, Enum
import math
import signal
import sys
from threading import Lock, Thread

from geometry_msgs.msg import Pose, Twist
from nav_msgs.msg import Odometry
from rcl_interfaces.msg import SetParametersResult
import rclpy
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.duration import Duration
from rclpy.exceptions import InvalidParameterValueException, NotInitializedException
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from rclpy.signals import SignalHandlerOptions
from rclpy.task import Future
from ros2_robot_controller.action import NavigateToPosition
from ros2_robot_controller.srv import GetRobotStatus, SetSpeed
from ros2_robot_controller.utils.conversions import normalize_angle, yaw_from_quaternion
from sensor_msgs.msg import LaserScan


class State(Enum):
    """What the robot is doing."""

    CRUISING = auto()  # at the set speed, which may be zero
    TURNING = auto()  # on the spot, towards the goal
    APPROACHING = auto()
    WAITING = auto()  # before an obstacle, for the way to be free


class RobotController(Node):
    """Everything the robot does."""

    def __init__(self):
        super().__init__('robot_controller')
        self.add_on_set_parameters_callback(self.refuse_nonsense)
        self.declare_parameters('', [
            ('robot_name', 'turtlebot4'), ('max_linear_speed', 0.5), ('max_angular_speed', 1.0),
            ('linear_acceleration', 1.0), ('angular_acceleration', 2.0),
            ('laser_processing_rate', 10.0), ('fusion_rate', 20.0),
            ('obstacle_detection_threshold', 0.5), ('emergency_stop_distance', 0.2),
            ('safety_margin', 0.3)])
        self.lock = Lock()
        self.state = State.CRUISING
        self.set_speed = 0.0
        self.sent = (0.0, 0.0)
        self.scan = None
        self.odom_pose = Pose()
        self.goal = None
        self.done = None
        self.over = False
        self.pub = self.create_publisher(Twist, 'cmd_vel', 1)
        self.create_subscription(LaserScan, 'scan', self.take_scan, qos_profile_sensor_data)
        self.create_subscription(Odometry, 'odom', self.take_odom, qos_profile_sensor_data)
        self.create_service(SetSpeed, 'set_speed', self.take_speed)
        self.create_service(GetRobotStatus, 'get_status', self.give_status)
        self.action = ActionServer(
            self, NavigateToPosition, 'navigate_to_position', self.execute,
            goal_callback=self.judge_goal, cancel_callback=lambda _: CancelResponse.ACCEPT)
        self.thread = Thread(target=self.work, daemon=True)
        self.thread.start()

    def p(self, name):
        """Return a parameter's value."""
        return self.get_parameter(name).value

    def refuse_nonsense(self, parameters):
        """Refuse negative numbers, and zero where something is divided by it."""
        for parameter in parameters:
            if isinstance(parameter.value, float):
                needs_more = parameter.name.endswith(('_rate', '_acceleration'))
                good = parameter.value > 0.0 or (parameter.value == 0.0 and not needs_more)
                if not (good and math.isfinite(parameter.value)):
                    return SetParametersResult(successful=False, reason='must be positive')
        return SetParametersResult(successful=True)

    # In the main thread: data in and out.

    def take_scan(self, scan):
        self.scan = scan

    def take_odom(self, odom):
        self.odom_pose = odom.pose.pose

    def take_speed(self, request, response):
        limit = self.p('max_linear_speed')
        if not math.isfinite(request.speed) or abs(request.speed) > limit + 1e-6:
            response.success = False
            response.message = f'Refused: the limit is {limit} m/s.'
        else:
            response.success = True
            response.message = f'Going at {request.speed:.3f} m/s.'
            self.set_speed = request.speed
        return response

    def give_status(self, _, response):
        backwards = self.state is State.CRUISING and self.set_speed < 0.0
        response.obstacle_detected = self.closest(backwards)[0] < self.p(
            'obstacle_detection_threshold')
        response.status = 'OBSTACLE_DETECTED' if response.obstacle_detected else 'ACTIVE'
        response.speed = float(self.set_speed)
        response.pose = self.odom_pose
        return response

    def judge_goal(self, goal):
        place = goal.target_pose.position
        if not math.isfinite(place.x + place.y) or not goal.tolerance > 0.0:
            return GoalResponse.REJECT
        return GoalResponse.ACCEPT

    async def execute(self, handle):
        with self.lock:
            if self.done is not None and not self.done.done():
                self.done.set_result('replaced')
            self.goal, self.done = handle, Future()
            self.state = State.TURNING
            done = self.done
        how = await done
        {'arrived': handle.succeed, 'canceled': handle.canceled,
         'replaced': handle.abort}[how]()
        return NavigateToPosition.Result(success=how == 'arrived', final_pose=self.odom_pose)

    # In the control thread.

    def work(self):
        clock = self.get_clock()
        try:
            while not self.over:
                clock.sleep_for(Duration(seconds=1.0 / self.p('laser_processing_rate')))
                with self.lock:
                    if not self.over:
                        self.step()
        except NotInitializedException:
            pass  # Ctrl-C

    def step(self):
        if self.state is State.CRUISING:
            self.send(self.set_speed, 0.0)
            return
        pose, target = self.odom_pose, self.goal.request.target_pose.position
        dx, dy = target.x - pose.position.x, target.y - pose.position.y
        left = math.hypot(dx, dy)
        error = normalize_angle(math.atan2(dy, dx) - yaw_from_quaternion(pose.orientation))
        self.goal.publish_feedback(NavigateToPosition.Feedback(distance_remaining=left))
        if self.goal.is_cancel_requested:
            self.finish('canceled')
        elif left <= self.goal.request.tolerance / 2.0:
            self.finish('arrived')
        elif self.state is State.TURNING:
            if abs(error) < 0.15:
                self.state = State.APPROACHING
            self.send(0.0, 1.2 * error)
        elif self.state is State.APPROACHING:
            if abs(error) > 0.6:
                self.state = State.TURNING
            elif self.closest(False)[0] < self.p('obstacle_detection_threshold'):
                self.state = State.WAITING
            self.send(min(0.4, 0.6 * left + 0.05), 1.2 * error)
        else:
            if self.closest(False)[0] >= self.p('obstacle_detection_threshold') + 0.05:
                self.state = State.TURNING
            self.send(0.0, 0.0)

    def finish(self, how):
        self.state = State.CRUISING
        self.set_speed = 0.0
        self.send(0.0, 0.0)
        self.done.set_result(how)

    def closest(self, backwards):
        """Return the closest reading in the direction of travel, and of all."""
        way, everywhere = [math.inf], [math.inf]
        scan = self.scan
        for i, r in enumerate(scan.ranges if scan is not None else ()):
            if scan.range_min <= r <= scan.range_max and r != 0.0 and not math.isinf(r):
                everywhere.append(r)
                angle = scan.angle_min + i * scan.angle_increment + (math.pi if backwards else 0.0)
                if abs(normalize_angle(angle)) < math.radians(60.0):
                    way.append(r)
        return min(way), min(everywhere)

    def send(self, v, w):
        way, everywhere = self.closest(v < 0.0)
        threshold = self.p('obstacle_detection_threshold')
        if everywhere < self.p('emergency_stop_distance'):
            v = w = 0.0
        elif way < threshold:
            v = 0.0
        elif way < threshold + self.p('safety_margin'):
            v = math.copysign(min(abs(v), 0.15), v)
        period = 1.0 / self.p('laser_processing_rate')
        self.sent = (
            self.limited(self.sent[0], v, self.p('max_linear_speed'),
                         self.p('linear_acceleration') * period),
            self.limited(self.sent[1], w, self.p('max_angular_speed'),
                         self.p('angular_acceleration') * period))
        self.publish()

    @staticmethod
    def limited(old, new, most, rise):
        """Return `new` as far as the limit and the ramp allow."""
        size = min(abs(new), most, rise + (abs(old) if old * new > 0.0 else 0.0))
        return math.copysign(size, new)

    def publish(self):
        message = Twist()
        message.linear.x, message.angular.z = self.sent
        self.pub.publish(message)

    def stop(self):
        """Say zero, last of all."""
        with self.lock:
            self.over = True
            self.sent = (0.0, 0.0)
            self.publish()
        self.pub.wait_for_all_acked(Duration(seconds=0.2))


def main():
    """Spin in the main thread until SIGINT or SIGTERM."""
    asked = []
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: asked.append(1))
    rclpy.init(args=sys.argv, signal_handler_options=SignalHandlerOptions.NO)
    try:
        node = RobotController()
    except InvalidParameterValueException as error:
        rclpy.try_shutdown()
        sys.exit(f'robot_controller: {error}')
    while not asked:
        rclpy.spin_once(node, timeout_sec=0.2)
    node.stop()
    rclpy.try_shutdown()  # wakes the thread
    node.thread.join(1.0)
