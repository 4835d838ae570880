"""The robot takes orders: a speed to drive at, and the question how it is."""

import math
from typing import Any

from ros2_robot_controller.driver import Driver
from ros2_robot_controller.srv import GetRobotStatus, SetSpeed
from ros2_robot_controller.utils import motion
from ros2_robot_controller.utils.conversions import clamp

FLOAT32_SLACK = 1e-6  # 0.3 arrives in a float32 message as 0.30000001


def speed_refusal(speed: float, limit: float) -> str:
    """Return why `speed` may not be set, in words that state the limit; empty if it may."""
    if not math.isfinite(speed):
        return f'a speed of {speed} is no number to drive at, the limit is {limit:.3g} m/s'
    if abs(speed) > limit * (1.0 + FLOAT32_SLACK):
        return f'{speed:.3g} m/s is beyond the limit of {limit:.3g} m/s'
    return ''


class SpeedServer(Driver):
    """
    Let others set the speed in force, and tell them how the robot is.

    Services: `set_speed` (SetSpeed), `get_status` (GetRobotStatus).
    Parameters: `max_linear_speed` limits what may be set; `robot_name` stands in the log.
    """

    def __init__(self, **node_options: Any) -> None:
        super().__init__(**node_options)
        self.create_service(SetSpeed, 'set_speed', self._on_set_speed)
        self.create_service(GetRobotStatus, 'get_status', self._on_get_status)

    def _on_set_speed(self, request: SetSpeed.Request,
                      response: SetSpeed.Response) -> SetSpeed.Response:
        limit = self._value('max_linear_speed')
        refusal = speed_refusal(request.speed, limit)
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

    def _obstacle_in_way(self) -> bool:
        return motion.obstacle_in_way(self._near, self._direction(), self._limits())

    def _direction(self) -> float:
        return self._speed  # its sign counts, and 0 looks forward
