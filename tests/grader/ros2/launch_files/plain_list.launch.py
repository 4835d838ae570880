"""Names imported one by one, a list of entities, a file found with ament_index_python."""
# ruff: noqa: PTH118 - as launch files are written

import os

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch_ros.actions import Node


def generate_launch_description():
    params = os.path.join(get_package_share_directory("demo"), "config", "demo.yaml")
    return LaunchDescription(
        [
            Node(package="demo", executable="show", name="first", output="screen", parameters=[params]),
            Node(package="demo", executable="show", remappings=[("chatter", "talk"), ("/odom", "odom")]),
            Node(package="demo", executable="show", arguments=["--rate", "5"], ros_arguments=["--log-level", "debug"]),
        ]
    )
