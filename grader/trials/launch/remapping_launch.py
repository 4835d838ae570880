"""Start both nodes of `package` with other names for some of their topics, as on a robot with its own names."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node


def generate_launch_description() -> LaunchDescription:
    """Return both nodes, remapped."""
    return LaunchDescription(
        [
            DeclareLaunchArgument("package"),
            Node(
                package=LaunchConfiguration("package"),
                executable="robot_controller",
                parameters=[{"use_sim_time": True}],
                remappings=[("cmd_vel", "base/cmd_vel"), ("scan", "front/scan")],
            ),
            Node(
                package=LaunchConfiguration("package"),
                executable="sensor_processor",
                parameters=[{"use_sim_time": True}],
                remappings=[("raw_scan", "front/scan"), ("obstacle_distance", "front/distance")],
            ),
        ]
    )
