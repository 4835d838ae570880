"""Start sensor_processor alone."""

import os

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node


def generate_launch_description() -> LaunchDescription:
    """Return the node with its parameter file."""
    share = get_package_share_directory('ros2_robot_controller')
    node = Node(
        package='ros2_robot_controller',
        executable='sensor_processor',
        name='sensor_processor',
        output='screen',
        parameters=[
            os.path.join(share, 'config', 'sensor_params.yaml'),
            {'use_sim_time': LaunchConfiguration('use_sim_time')},
        ],
        remappings=[('raw_scan', LaunchConfiguration('raw_scan'))],
    )
    return LaunchDescription([
        DeclareLaunchArgument('use_sim_time', default_value='false',
                              description='Follow /clock, as in a simulator.'),
        DeclareLaunchArgument('raw_scan', default_value='raw_scan',
                              description='Topic to take the scans from.'),
        node,
    ])
