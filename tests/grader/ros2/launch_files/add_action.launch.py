"""Whole modules imported, actions added one by one."""

import launch
import launch.actions
import launch_ros.actions
from launch.substitutions.path_join_substitution import PathJoinSubstitution
from launch_ros.substitutions import FindPackageShare


def generate_launch_description():
    ld = launch.LaunchDescription()
    declare = launch.actions.DeclareLaunchArgument("who", default_value="world", description="Whom to greet")
    config = launch.substitutions.LaunchConfiguration("who")
    node = launch_ros.actions.Node(package="demo", executable="show", exec_name="greeter", arguments=["hello", config])
    ld.add_action(declare)
    ld.add_action(node)
    ld.add_entity(
        launch_ros.actions.Node(
            package="demo",
            executable="show",
            parameters=[PathJoinSubstitution([FindPackageShare("demo"), "config", "demo.yaml"])],
        )
    )
    return ld
