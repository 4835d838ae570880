"""An include leaks: its arguments, given and declared, remain set afterwards, unless a group is around it."""
# ruff: noqa: PTH118, PTH120 - as launch files are written

import os

from launch import LaunchDescription
from launch.actions import GroupAction, IncludeLaunchDescription
from launch.launch_description_sources import AnyLaunchDescriptionSource, PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node


def after():
    return Node(
        package="demo",
        executable="show",
        arguments=[LaunchConfiguration("word", default="unset"), LaunchConfiguration("inner", default="unset")],
    )


def generate_launch_description():
    here = os.path.dirname(__file__)
    child = PathJoinSubstitution([here, "child_launch.py"])
    return LaunchDescription(
        [
            GroupAction(
                [
                    IncludeLaunchDescription(
                        PythonLaunchDescriptionSource(os.path.join(here, "child_launch.py")),
                        launch_arguments={"word": "grouped"}.items(),
                    ),
                    after(),
                ]
            ),
            after(),
            IncludeLaunchDescription(
                PythonLaunchDescriptionSource([here, "/child_launch.py"]),
                launch_arguments=[("word", "given")],
            ),
            after(),
            IncludeLaunchDescription(AnyLaunchDescriptionSource(child), launch_arguments={"word": "again"}.items()),
        ]
    )
