"""Groups restore configurations and environment, unless they are not scoped."""

from launch import LaunchDescription
from launch.actions import GroupAction, SetEnvironmentVariable, SetLaunchConfiguration
from launch.substitutions import EnvironmentVariable, LaunchConfiguration
from launch_ros.actions import Node


def state():
    x = LaunchConfiguration("x", default="none")
    return Node(package="demo", executable="show", arguments=[x, EnvironmentVariable("DEMO", default_value="none")])


def change(value):
    return [SetLaunchConfiguration("x", value), SetEnvironmentVariable("DEMO", value), state()]


def generate_launch_description():
    return LaunchDescription(
        [
            *change("outer"),
            GroupAction(change("scoped")),
            state(),
            GroupAction(change("leaked"), scoped=False),
            state(),
        ]
    )
