"""Included by others."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node


def generate_launch_description():
    return LaunchDescription(
        [
            DeclareLaunchArgument("word", description="What to say."),
            DeclareLaunchArgument("inner", default_value="by-default"),
            Node(package="demo", executable="show", arguments=["child", LaunchConfiguration("word")]),
        ]
    )
