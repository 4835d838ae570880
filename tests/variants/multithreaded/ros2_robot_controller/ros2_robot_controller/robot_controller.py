"""Drive a robot with many threads: sensors, control and the action each have their own."""

from dataclasses import fields
import threading

from geometry_msgs.msg import Pose, Twist
from nav_msgs.msg import Odometry
import rclpy
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup
from rclpy.duration import Duration
from rclpy.exceptions import ParameterException, ROSInterruptException
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from rclpy.signals import SignalHandlerOptions
from ros2_robot_controller.action import NavigateToPosition
from ros2_robot_controller.srv import GetRobotStatus, SetSpeed
from ros2_robot_controller.utils import motion, settings, steering
from ros2_robot_controller.utils.conversions import clamp, yaw_from_quaternion
from ros2_robot_controller.utils.motion import Command, Limits, STOP
from ros2_robot_controller.utils.scans import measure_proximity, Proximity
from ros2_robot_controller.utils.steering import Place
from sensor_msgs.msg import LaserScan

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


class RobotController(Node):
    """
    Drive at a set speed or to a goal; one control timer publishes every command.

    The action's own thread decides where to go and puts its wish where the control timer finds
    it. A second goal is refused while one is under way.
    """

    def __init__(self) -> None:
        super().__init__('robot_controller')
        settings.declare(self, SETTINGS)
        self._lock = threading.RLock()
        self._speed = 0.0
        self._near = Proximity()
        self._pose = Pose()
        self._place = None
        self._sent = STOP
        self._wish = None  # what the action wants; None while there is no goal
        self._busy = False
        self._stopping = False

        self._rate = self.create_rate(self._get('fusion_rate'))  # goes by the node's clock
        sensors, services = ReentrantCallbackGroup(), ReentrantCallbackGroup()
        self._cmd_vel = self.create_publisher(Twist, 'cmd_vel', 10)
        self.create_subscription(LaserScan, 'scan', self._scan, qos_profile_sensor_data,
                                 callback_group=sensors)
        self.create_subscription(Odometry, 'odom', self._odom, qos_profile_sensor_data,
                                 callback_group=sensors)
        self.create_service(SetSpeed, 'set_speed', self._set_speed, callback_group=services)
        self.create_service(GetRobotStatus, 'get_status', self._status, callback_group=services)
        self._server = ActionServer(
            self, NavigateToPosition, 'navigate_to_position', self._execute,
            goal_callback=self._accept, cancel_callback=lambda _: CancelResponse.ACCEPT,
            callback_group=ReentrantCallbackGroup())
        self.create_timer(1.0 / self._get('laser_processing_rate'), self._control,
                          callback_group=MutuallyExclusiveCallbackGroup())

    def _get(self, name):
        return self.get_parameter(name).value

    def _limits(self) -> Limits:
        return Limits(**{limit.name: self._get(limit.name) for limit in fields(Limits)})

    def _scan(self, scan: LaserScan) -> None:
        near = measure_proximity(scan)
        with self._lock:
            self._near = near

    def _odom(self, odom: Odometry) -> None:
        pose = odom.pose.pose
        with self._lock:
            self._pose = pose
            self._place = Place(pose.position.x, pose.position.y,
                                yaw_from_quaternion(pose.orientation))

    def _control(self) -> None:
        limits = self._limits()
        dt = 1.0 / self._get('laser_processing_rate')
        with self._lock:
            wanted = Command(v=self._speed) if self._wish is None else self._wish
            safe = motion.make_safe(wanted, self._near, limits)
            self._publish(motion.speed_up_gently(self._sent, safe, dt, limits))

    def _publish(self, command: Command) -> None:
        if self._stopping:  # another thread may be about to send something else
            command = STOP
        twist = Twist()
        twist.linear.x, twist.angular.z = command.v, command.omega
        self._cmd_vel.publish(twist)
        self._sent = command

    def _set_speed(self, request, response):
        limit = self._get('max_linear_speed')
        # False for NaN; float32 rounds 0.3 up.
        response.success = abs(request.speed) <= limit + 1e-6
        response.message = f'{request.speed:g} m/s, the limit is {limit:g} m/s'
        if response.success:
            with self._lock:
                self._speed = clamp(request.speed, -limit, limit)
        return response

    def _status(self, _, response):
        with self._lock:
            ahead = self._speed if self._wish is None else 0.0
            response.speed = self._speed
            response.pose = self._pose
            response.obstacle_detected = motion.obstacle_in_way(self._near, ahead, self._limits())
        response.status = 'OBSTACLE_DETECTED' if response.obstacle_detected else 'ACTIVE'
        return response

    def _accept(self, request) -> GoalResponse:
        target = request.target_pose.position
        if steering.goal_refusal(target.x, target.y, request.tolerance):
            return GoalResponse.REJECT
        with self._lock:
            if self._busy:
                return GoalResponse.REJECT
            self._busy = True
        return GoalResponse.ACCEPT

    def _execute(self, handle):
        try:
            arrived = self._drive(handle)
        except ROSInterruptException:  # Ctrl-C; there is nobody left to tell
            return NavigateToPosition.Result()
        with self._lock:
            self._wish = None
            self._speed = 0.0
            self._busy = False
            self._publish(STOP)
            pose = self._pose
        if arrived:
            handle.succeed()
        elif handle.is_cancel_requested:
            handle.canceled()
        else:
            handle.abort()
        return NavigateToPosition.Result(success=arrived, final_pose=pose)

    def _drive(self, handle) -> bool:
        target = handle.request.target_pose.position
        feedback = NavigateToPosition.Feedback()
        while not handle.is_cancel_requested:
            with self._lock:
                place, near = self._place, self._near
            if place is not None:
                distance = steering.distance_to(place, target.x, target.y)
                limits = self._limits()
                blocked = motion.obstacle_in_way(near, 0.0, limits)
                if steering.has_arrived(distance, handle.request.tolerance, blocked):
                    return True
                with self._lock:
                    self._wish = steering.steer(place, target.x, target.y, limits)
                feedback.distance_remaining = distance
                handle.publish_feedback(feedback)
            self._rate.sleep()
        return False

    def stop(self) -> None:
        """Command a standstill and wait until it is out."""
        with self._lock:
            self._stopping = True
            self._publish(STOP)
        self._cmd_vel.wait_for_all_acked(Duration(seconds=0.2))


def main(args=None) -> None:
    """Spin until Ctrl-C."""
    # With rclpy's own handlers the context would be gone before the last command is out.
    rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
    try:
        node = RobotController()
    except ParameterException as error:
        rclpy.logging.get_logger('robot_controller').fatal(str(error))
        rclpy.try_shutdown()
        raise SystemExit(1) from error
    executor = MultiThreadedExecutor(num_threads=4)
    executor.add_node(node)
    try:
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        node.stop()
    finally:
        rclpy.try_shutdown()  # wakes the action's thread, whose rate raises


if __name__ == '__main__':
    main()
