"""Texts of files that the course gives and that no reference holds: what stands in for a capability yet to come.

ROS's style holds in them (single quotes, 99 columns), for they become part of the student's package.
"""

from __future__ import annotations

ROBOT_CONTROLLER_01 = '''\
"""The node that drives the robot. So far it has a name and does nothing."""

from typing import Any, Optional

from rclpy.node import Node
from ros2_robot_controller.utils.running import run


class RobotController(Node):
    """A node that is there, and that is all."""

    def __init__(self, **node_options: Any) -> None:
        super().__init__('robot_controller', **node_options)


def main(args: Optional[list[str]] = None) -> int:
    """Run the node until Ctrl-C; return the exit code."""
    return run(RobotController, args)
'''

SENSOR_PROCESSOR_01 = '''\
"""The node that fuses the sensors. So far it has a name and does nothing."""

from typing import Any, Optional

from rclpy.node import Node
from ros2_robot_controller.utils.running import run


class SensorProcessor(Node):
    """A node that is there, and that is all."""

    def __init__(self, **node_options: Any) -> None:
        super().__init__('sensor_processor', **node_options)


def main(args: Optional[list[str]] = None) -> int:
    """Run the node until Ctrl-C; return the exit code."""
    return run(SensorProcessor, args)
'''

RUNNING_01 = '''\
"""Run a node from its start to Ctrl-C. Knows no particular node."""

from collections.abc import Callable
from typing import Optional

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node


def run(make_node: Callable[[], Node], args: Optional[list[str]] = None) -> int:
    """Spin the node that `make_node` makes until Ctrl-C or SIGTERM; return the exit code."""
    rclpy.init(args=args)
    try:
        rclpy.spin(make_node())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass  # this is how a node is told to end
    finally:
        rclpy.try_shutdown()
    return 0
'''

SETTINGS_04 = '''\
"""Declare parameters. So far every value is taken; what makes no sense is refused later."""

from dataclasses import dataclass
from typing import Any

from rclpy.node import Node


@dataclass(frozen=True)
class Setting:
    """A parameter's default."""

    default: Any


def at_least_zero(default: float) -> Setting:
    """Return a setting for a size that may be zero: a distance, a speed limit."""
    return Setting(default)


def above_zero(default: float) -> Setting:
    """Return a setting for a size that must not be zero: an acceleration."""
    return Setting(default)


def rate(default: float) -> Setting:
    """Return a setting for a rate in Hz."""
    return Setting(default)


def percentage(default: float) -> Setting:
    """Return a setting for a share in percent."""
    return Setting(default)


def name(default: str) -> Setting:
    """Return a setting for a name."""
    return Setting(default)


def declare(node: Node, settings: dict[str, Setting]) -> None:
    """Declare the parameters on the node."""
    for parameter, setting in settings.items():
        node.declare_parameter(parameter, setting.default)
'''

ROBOT_CONTROLLER_05 = '''\
"""The node that drives the robot, as far as it goes: a parameter says how fast."""

from typing import Any, Optional

from rclpy.parameter import Parameter
from ros2_robot_controller.driver import Driver
from ros2_robot_controller.utils.running import run


class RobotController(Driver):
    """
    Drive at the speed that the parameter `speed` says, in m/s.

    A makeshift: a service will set the speed, and can say no.
    """

    def __init__(self, **node_options: Any) -> None:
        super().__init__(**node_options)
        self._speed = self.declare_parameter('speed', 0.0).value
        self.add_post_set_parameters_callback(self._on_parameters_changed)

    def _on_parameters_changed(self, parameters: list[Parameter]) -> None:
        for parameter in parameters:
            if parameter.name == 'speed':
                self._speed = parameter.value


def main(args: Optional[list[str]] = None) -> int:
    """Run the node until Ctrl-C; return the exit code."""
    return run(RobotController, args)
'''

ROBOT_CONTROLLER_06 = '''\
"""The node that drives the robot, as far as it goes: it takes orders."""

from typing import Optional

from ros2_robot_controller.speed_server import SpeedServer
from ros2_robot_controller.utils.running import run


def main(args: Optional[list[str]] = None) -> int:
    """Run the node until Ctrl-C; return the exit code."""
    return run(SpeedServer, args)
'''

ROBOT_CONTROLLER_07 = '''\
"""The node that drives the robot, as far as it goes: it takes orders and finds its way."""

from typing import Optional

from ros2_robot_controller.navigator import Navigator
from ros2_robot_controller.utils.running import run


def main(args: Optional[list[str]] = None) -> int:
    """Run the node until Ctrl-C; return the exit code."""
    return run(Navigator, args)
'''
