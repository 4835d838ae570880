"""
The node that drives the robot, whole: four layers, each with one thing more.

Driver drives safely, SpeedServer takes a speed, Navigator drives to goals, and RobotController
lets parameters change meanwhile. Callbacks move data; utils.motion and utils.steering decide.
"""

from typing import Any, Optional

from rclpy.parameter import Parameter
from ros2_robot_controller.navigator import Navigator
from ros2_robot_controller.utils.conversions import clamp
from ros2_robot_controller.utils.running import run


class RobotController(Navigator):
    """
    Drive at a set speed or to a goal, and never into anything.

    Parameters: all of them may change while the node runs.
    """

    def __init__(self, **node_options: Any) -> None:
        super().__init__(**node_options)
        self.add_post_set_parameters_callback(self._on_parameters_changed)
        self.get_logger().info(f"{self._value('robot_name')} is ready")

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


def main(args: Optional[list[str]] = None) -> int:
    """Run the node until Ctrl-C; return the exit code."""
    return run(RobotController, args)
