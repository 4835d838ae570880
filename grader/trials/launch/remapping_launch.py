"""Start both nodes with other names for some of their topics, as a launch file does on a robot with its own names."""

from launch import LaunchDescription
from launch_ros.actions import Node


def generate_launch_description() -> LaunchDescription:
    """Return both nodes, remapped."""
    return LaunchDescription(
        [
            Node(
                package="ros2_robot_controller",
                executable="robot_controller",
                parameters=[{"use_sim_time": True}],
                remappings=[("cmd_vel", "base/cmd_vel"), ("scan", "front/scan")],
            ),
            Node(
                package="ros2_robot_controller",
                executable="sensor_processor",
                parameters=[{"use_sim_time": True}],
                remappings=[("raw_scan", "front/scan"), ("obstacle_distance", "front/distance")],
            ),
        ]
    )
