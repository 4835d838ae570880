"""The node that drives the robot. Callbacks move data; utils.motion decides."""

from dataclasses import dataclass, field, fields
from enum import Enum
import math
from typing import Any, Optional

from geometry_msgs.msg import Pose, Twist
from nav_msgs.msg import Odometry
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.action.server import ServerGoalHandle
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import qos_profile_sensor_data
from rclpy.task import Future
from ros2_robot_controller.action import NavigateToPosition
from ros2_robot_controller.srv import GetRobotStatus, SetSpeed
from ros2_robot_controller.utils import motion, settings
from ros2_robot_controller.utils.conversions import clamp, yaw_from_quaternion
from ros2_robot_controller.utils.motion import Command, Limits, Place, STOP
from ros2_robot_controller.utils.running import run
from ros2_robot_controller.utils.scans import measure_proximity, Proximity
from sensor_msgs.msg import LaserScan

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


class Ending(Enum):
    """How a goal ends."""

    ARRIVED = 'arrived'
    CANCELED = 'canceled'
    REPLACED = 'replaced'


@dataclass
class Goal:
    """The goal being driven to; `ending` gets an Ending when the drive is over."""

    handle: ServerGoalHandle
    x: float
    y: float
    tolerance: float
    ending: Future = field(default_factory=Future)


class RobotController(Node):
    """
    Drive at a set speed or to a goal, and never into anything.

    Subscribes: `scan` (sensor_msgs/LaserScan), `odom` (nav_msgs/Odometry), both best effort.
    Publishes: `cmd_vel` (geometry_msgs/Twist) at `laser_processing_rate`, and a stop at once.
    Services: `set_speed` (SetSpeed), `get_status` (GetRobotStatus).
    Action: `navigate_to_position` (NavigateToPosition), feedback at `fusion_rate`.
    Parameters: see SETTINGS. All of them may change while the node runs.

    The robot stands still while it has no scan younger than STALE_S, and during a goal while it
    has no such odometry. A new goal replaces the running one. However a goal ends, the speed in
    force is 0 afterwards.
    """

    def __init__(self, **node_options: Any) -> None:
        super().__init__('robot_controller', **node_options)
        settings.declare(self, SETTINGS)

        self._speed = 0.0  # the speed in force, m/s
        self._goal: Optional[Goal] = None
        self._near = Proximity()
        self._scan_time = -math.inf
        self._pose = Pose()
        self._place: Optional[Place] = None
        self._odom_time = -math.inf
        self._last_command = STOP
        self._last_command_time = self._now()

        self._cmd_vel = self.create_publisher(Twist, 'cmd_vel', 10)
        self.create_subscription(LaserScan, 'scan', self._on_scan, qos_profile_sensor_data)
        self.create_subscription(Odometry, 'odom', self._on_odom, qos_profile_sensor_data)
        self.create_service(SetSpeed, 'set_speed', self._on_set_speed)
        self.create_service(GetRobotStatus, 'get_status', self._on_get_status)
        self._action_server = ActionServer(
            self, NavigateToPosition, 'navigate_to_position', self._navigate,
            goal_callback=self._on_goal, cancel_callback=self._on_cancel)
        self._control_timer = self.create_timer(self._period('laser_processing_rate'),
                                                self._control)
        self._feedback_timer = self.create_timer(self._period('fusion_rate'),
                                                 self._give_feedback)
        self.add_post_set_parameters_callback(self._on_parameters_changed)
        self.get_logger().info(f"{self._value('robot_name')} is ready")

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
        return 0.0 <= self._now() - time <= STALE_S  # below 0: the clock was set back

    def _obstacle_in_way(self) -> bool:
        direction = 0.0 if self._goal is not None else self._speed
        return motion.obstacle_in_way(self._near, direction, self._limits())

    # Sensors

    def _on_scan(self, scan: LaserScan) -> None:
        self._near = measure_proximity(scan)
        self._scan_time = self._now()
        # Do not let a stop wait for the next control step.
        if motion.make_safe(self._last_command, self._near, self._limits()) == STOP:
            if self._last_command != STOP:
                self._publish(STOP)

    def _on_odom(self, odom: Odometry) -> None:
        pose = odom.pose.pose
        place = Place(pose.position.x, pose.position.y, yaw_from_quaternion(pose.orientation))
        if math.isfinite(place.x + place.y + place.yaw):
            self._pose, self._place, self._odom_time = pose, place, self._now()

    # The control loop

    def _control(self) -> None:
        self._end_goal_if_over()
        limits = self._limits()
        wanted = motion.make_safe(self._wanted(limits), self._near, limits)
        period = self._period('laser_processing_rate')
        dt = clamp(self._now() - self._last_command_time, 0.0, MAX_DT_PERIODS * period)
        self._publish(motion.speed_up_gently(self._last_command, wanted, dt, limits))

    def _wanted(self, limits: Limits) -> Command:
        if not self._is_fresh(self._scan_time):
            return STOP
        if self._goal is None:
            return Command(v=self._speed)
        if not self._is_fresh(self._odom_time):
            return STOP
        return motion.steer(self._place, self._goal.x, self._goal.y, limits)

    def _publish(self, command: Command) -> None:
        twist = Twist()
        twist.linear.x = command.v
        twist.angular.z = command.omega
        self._cmd_vel.publish(twist)
        self._last_command = command
        self._last_command_time = self._now()

    # Services

    def _on_set_speed(self, request: SetSpeed.Request,
                      response: SetSpeed.Response) -> SetSpeed.Response:
        limit = self._value('max_linear_speed')
        refusal = motion.speed_refusal(request.speed, limit)
        response.success = not refusal
        if refusal:
            response.message = f'Speed unchanged: {refusal}'
        else:
            self._speed = clamp(request.speed, -limit, limit)
            response.message = f'Speed set to {self._speed:.3g} m/s, the limit is {limit:.3g} m/s'
        self.get_logger().info(f"{self._value('robot_name')}: {response.message}")
        return response

    def _on_get_status(self, _: GetRobotStatus.Request,
                       response: GetRobotStatus.Response) -> GetRobotStatus.Response:
        response.speed = self._speed
        response.obstacle_detected = self._obstacle_in_way()
        response.pose = self._pose
        response.status = 'OBSTACLE_DETECTED' if response.obstacle_detected else 'ACTIVE'
        return response

    # The action

    def _on_goal(self, request: NavigateToPosition.Goal) -> GoalResponse:
        target = request.target_pose.position
        refusal = motion.goal_refusal(target.x, target.y, request.tolerance)
        if refusal:
            self.get_logger().warning(f'Goal rejected: {refusal}')
            return GoalResponse.REJECT
        return GoalResponse.ACCEPT

    def _on_cancel(self, _: ServerGoalHandle) -> CancelResponse:
        return CancelResponse.ACCEPT  # rclpy's default is to refuse

    async def _navigate(self, handle: ServerGoalHandle) -> NavigateToPosition.Result:
        # Awaiting, not looping: the one thread goes on serving sensors, control and cancels.
        self._end_goal(Ending.REPLACED)
        target = handle.request.target_pose.position
        goal = Goal(handle, target.x, target.y, handle.request.tolerance)
        self._goal = goal
        ending = await goal.ending
        {
            Ending.ARRIVED: handle.succeed,
            Ending.CANCELED: handle.canceled,
            Ending.REPLACED: handle.abort,
        }[ending]()
        self.get_logger().info(f"{self._value('robot_name')}: goal {ending.value}")
        return NavigateToPosition.Result(
            success=ending is Ending.ARRIVED, final_pose=self._pose)

    def _end_goal_if_over(self) -> None:
        goal = self._goal
        if goal is None:
            return
        if goal.handle.is_cancel_requested:
            self._end_goal(Ending.CANCELED)
        elif self._is_fresh(self._odom_time) and motion.has_arrived(
                motion.distance_to(self._place, goal.x, goal.y), goal.tolerance,
                self._obstacle_in_way()):
            self._end_goal(Ending.ARRIVED)

    def _end_goal(self, ending: Ending) -> None:
        if self._goal is not None:
            self._goal.ending.set_result(ending)
            self._goal = None
            self._speed = 0.0  # or the robot would drive off from where it was sent

    def _give_feedback(self) -> None:
        if self._goal is None or self._place is None:
            return
        distance = motion.distance_to(self._place, self._goal.x, self._goal.y)
        self._goal.handle.publish_feedback(
            NavigateToPosition.Feedback(distance_remaining=distance))

    # Changes and the end

    def _on_parameters_changed(self, parameters: list[Parameter]) -> None:
        changed = {parameter.name for parameter in parameters}
        limit = self._value('max_linear_speed')
        self._speed = clamp(self._speed, -limit, limit)
        # A timer keeps the period it was made with.
        if 'laser_processing_rate' in changed:
            self.destroy_timer(self._control_timer)
            self._control_timer = self.create_timer(self._period('laser_processing_rate'),
                                                    self._control)
        if 'fusion_rate' in changed:
            self.destroy_timer(self._feedback_timer)
            self._feedback_timer = self.create_timer(self._period('fusion_rate'),
                                                     self._give_feedback)

    def stop(self) -> None:
        """Command a standstill and give the message time to leave."""
        self._publish(STOP)
        self._cmd_vel.wait_for_all_acked(Duration(seconds=LAST_WORD_S))


def main(args: Optional[list[str]] = None) -> int:
    """Run the node until Ctrl-C; return the exit code."""
    return run(RobotController, args)
