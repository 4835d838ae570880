"""Start both nodes of `package` in a namespace, with other names for some topics: as on one robot of several."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node


def generate_launch_description() -> LaunchDescription:
    """Return both nodes, in the namespace and remapped."""
    return LaunchDescription(
        [
            DeclareLaunchArgument("package"),
            Node(
                package=LaunchConfiguration("package"),
                executable="robot_controller",
                namespace="robot7",
                parameters=[{"use_sim_time": True}],
                remappings=[("cmd_vel", "base/cmd_vel"), ("scan", "front/scan")],
            ),
            Node(
                package=LaunchConfiguration("package"),
                executable="sensor_processor",
                namespace="robot7",
                parameters=[{"use_sim_time": True}],
                remappings=[("raw_scan", "front/scan"), ("obstacle_distance", "front/distance")],
            ),
        ]
    )
