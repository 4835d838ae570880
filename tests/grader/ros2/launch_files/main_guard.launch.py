"""A launch file that runs itself, with a script's LaunchService."""

import sys

import launch
from launch.actions import DeclareLaunchArgument as Arg
from launch.substitutions import LaunchConfiguration as LC
from launch_ros.actions import *  # noqa: F403


def generate_launch_description():
    node = Node(package="demo", executable="show", arguments=[LC("y")])  # noqa: F405
    return launch.LaunchDescription([Arg("y", default_value="z"), node])


if __name__ == "__main__":
    service = launch.LaunchService(argv=sys.argv[1:])
    service.include_launch_description(generate_launch_description())
    sys.exit(service.run())
