"""The robot finds its way: drive to a place, tell how far it still is, and be called back."""

from dataclasses import dataclass, field
from enum import Enum
from typing import Any, Optional

from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.action.server import ServerGoalHandle
from rclpy.task import Future
from ros2_robot_controller.action import NavigateToPosition
from ros2_robot_controller.driver import NEVER
from ros2_robot_controller.speed_server import SpeedServer
from ros2_robot_controller.utils import steering
from ros2_robot_controller.utils.motion import Command, Limits, STOP


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


class Navigator(SpeedServer):
    """
    Drive to a goal when there is one, and at the speed in force otherwise.

    Action: `navigate_to_position` (NavigateToPosition), feedback at `fusion_rate`.
    Parameters: `fusion_rate`.

    During a goal the robot stands still while it has no odometry younger than STALE_S. A new
    goal replaces the running one. However a goal ends, the speed in force is 0 afterwards.
    """

    def __init__(self, **node_options: Any) -> None:
        super().__init__(**node_options)
        self._goal: Optional[Goal] = None
        self._action_server = ActionServer(
            self, NavigateToPosition, 'navigate_to_position', self._navigate,
            goal_callback=self._on_goal, cancel_callback=self._on_cancel)
        self._feedback_timer = self.create_timer(self._period('fusion_rate'),
                                                 self._give_feedback)

    # What others ask

    def _on_goal(self, request: NavigateToPosition.Goal) -> GoalResponse:
        target = request.target_pose.position
        refusal = steering.goal_refusal(target.x, target.y, request.tolerance)
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

    # On the way

    def _control(self) -> None:
        self._end_goal_if_over()
        super()._control()

    def _wanted(self, limits: Limits) -> Command:
        if self._goal is None:
            return super()._wanted(limits)
        if not self._is_fresh(self._odom_time):
            return STOP
        place = steering.place_of(self._pose)
        return steering.steer(place, self._goal.x, self._goal.y, limits)

    def _direction(self) -> float:
        # It drives to a goal forwards, whatever the speed in force.
        return super()._direction() if self._goal is None else 0.0

    def _distance_to(self, goal: Goal) -> float:
        return steering.distance_to(steering.place_of(self._pose), goal.x, goal.y)

    def _give_feedback(self) -> None:
        goal = self._goal
        if goal is None or self._odom_time == NEVER:
            return
        goal.handle.publish_feedback(
            NavigateToPosition.Feedback(distance_remaining=self._distance_to(goal)))

    # The end of the way

    def _end_goal_if_over(self) -> None:
        goal = self._goal
        if goal is None:
            return
        if goal.handle.is_cancel_requested:
            self._end_goal(Ending.CANCELED)
        elif self._is_fresh(self._odom_time) and steering.has_arrived(
                self._distance_to(goal), goal.tolerance, self._obstacle_in_way()):
            self._end_goal(Ending.ARRIVED)

    def _end_goal(self, ending: Ending) -> None:
        if self._goal is not None:
            self._goal.ending.set_result(ending)
            self._goal = None
            self._speed = 0.0  # or the robot would drive off from where it was sent
