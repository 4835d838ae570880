#!/usr/bin/env python3
"""Show what robot_controller can do: set the speed, be refused, read the status, go somewhere."""

import math
import sys
from typing import Any

from action_msgs.msg import GoalStatus
from geometry_msgs.msg import Pose
import rclpy
from rclpy.action import ActionClient
from rclpy.action.client import ClientGoalHandle
from rclpy.client import Client
from rclpy.node import Node
from rclpy.task import Future
from ros2_robot_controller.action import NavigateToPosition
from ros2_robot_controller.srv import GetRobotStatus, SetSpeed
from ros2_robot_controller.utils.conversions import yaw_from_quaternion

ANSWER_S = 10.0  # wall time; a node that runs answers in milliseconds
DRIVE_S = 20.0  # wall time; after that the goal is canceled
STEP_M = 0.5  # how far ahead the goal lies
TOLERANCE_M = 0.1
SPEED_MPS = 0.1
TOO_FAST_MPS = 100.0


class NoAnswer(Exception):
    """Something did not answer in time; the message says what and what to do."""


class Demo(Node):
    """A client of everything that robot_controller offers."""

    def __init__(self) -> None:
        super().__init__('demo')
        self._set_speed = self.create_client(SetSpeed, 'set_speed')
        self._get_status = self.create_client(GetRobotStatus, 'get_status')
        self._navigate = ActionClient(self, NavigateToPosition, 'navigate_to_position')
        self._last_words = math.inf  # the distance that was told last, metres

    def show(self) -> None:
        """Go through the demonstration; raises NoAnswer."""
        for speed in (SPEED_MPS, TOO_FAST_MPS, 0.0):
            answer = self.call(self._set_speed, SetSpeed.Request(speed=speed))
            self.get_logger().info(f'set_speed {speed:g}: {answer.message}')
        self.get_logger().info(f'get_status: {self.status().status}')
        handle = self.send_goal(self.place_ahead())
        self.get_logger().info(f'navigate_to_position: {self.finish(handle)}')
        position = self.status().pose.position
        self.get_logger().info(f'The robot is at ({position.x:.2f}, {position.y:.2f}).')

    def call(self, client: Client, request: Any) -> Any:
        """Return a service's response."""
        if not client.wait_for_service(timeout_sec=ANSWER_S):
            raise NoAnswer(f'No node offers {client.srv_name}. Start robot_controller first.')
        return self.wait_for(client.call_async(request), client.srv_name)

    def wait_for(self, future: Future, what: str) -> Any:
        """Return the future's result."""
        rclpy.spin_until_future_complete(self, future, timeout_sec=ANSWER_S)
        if not future.done():
            raise NoAnswer(f'{what} gave no answer within {ANSWER_S:g} s. Is the node busy?')
        return future.result()

    def status(self) -> GetRobotStatus.Response:
        """Return the robot's status."""
        return self.call(self._get_status, GetRobotStatus.Request())

    def place_ahead(self) -> Pose:
        """Return the place STEP_M in front of the robot."""
        place = self.status().pose
        yaw = yaw_from_quaternion(place.orientation)
        place.position.x += STEP_M * math.cos(yaw)
        place.position.y += STEP_M * math.sin(yaw)
        return place

    def send_goal(self, target: Pose) -> ClientGoalHandle:
        """Return the handle of an accepted goal."""
        if not self._navigate.wait_for_server(timeout_sec=ANSWER_S):
            raise NoAnswer('No node offers navigate_to_position. Start robot_controller first.')
        goal = NavigateToPosition.Goal(target_pose=target, tolerance=TOLERANCE_M)
        handle = self.wait_for(self._navigate.send_goal_async(goal, self.on_feedback), 'The goal')
        if not handle.accepted:
            raise NoAnswer('The goal was rejected. Does odom carry numbers?')
        return handle

    def on_feedback(self, message: Any) -> None:
        """Tell the distance each time it has fallen by a tenth of a metre."""
        distance = message.feedback.distance_remaining
        if distance <= self._last_words - 0.1:
            self.get_logger().info(f'{distance:.2f} m to go')
            self._last_words = distance

    def finish(self, handle: ClientGoalHandle) -> str:
        """Wait for the goal's end, or cancel it after DRIVE_S; return how it ended in words."""
        result = handle.get_result_async()
        rclpy.spin_until_future_complete(self, result, timeout_sec=DRIVE_S)
        if not result.done():
            self.get_logger().warning(f'Not there after {DRIVE_S:g} s: cancelling.')
            self.wait_for(handle.cancel_goal_async(), 'The cancel request')
        status = self.wait_for(result, 'The result').status
        return {
            GoalStatus.STATUS_SUCCEEDED: 'arrived',
            GoalStatus.STATUS_CANCELED: 'canceled',
        }.get(status, 'replaced by another goal')


def main() -> int:
    """Run the demonstration; return 0 if everything answered."""
    rclpy.init()
    demo = Demo()
    try:
        demo.show()
    except NoAnswer as error:
        demo.get_logger().error(str(error))
        return 1
    except KeyboardInterrupt:
        return 130
    finally:
        demo.destroy_node()
        rclpy.try_shutdown()
    return 0


if __name__ == '__main__':
    sys.exit(main())
