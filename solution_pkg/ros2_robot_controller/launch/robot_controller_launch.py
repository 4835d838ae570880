"""Start the whole robot: robot_controller and sensor_processor."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare


def generate_launch_description() -> LaunchDescription:
    """Return both nodes with their parameter files, on one clock."""
    config = [FindPackageShare('ros2_robot_controller'), 'config']
    use_sim_time = {'use_sim_time': LaunchConfiguration('use_sim_time')}
    return LaunchDescription([
        DeclareLaunchArgument(
            'use_sim_time', default_value='false',
            description='Follow /clock, as in a simulator.'),
        DeclareLaunchArgument(
            'raw_scan', default_value='raw_scan',
            description='Topic that sensor_processor takes its scans from.'),
        Node(
            package='ros2_robot_controller',
            executable='robot_controller',
            name='robot_controller',
            output='screen',
            parameters=[PathJoinSubstitution([*config, 'robot_params.yaml']), use_sim_time],
        ),
        Node(
            package='ros2_robot_controller',
            executable='sensor_processor',
            name='sensor_processor',
            output='screen',
            parameters=[PathJoinSubstitution([*config, 'sensor_params.yaml']), use_sim_time],
            remappings=[('raw_scan', LaunchConfiguration('raw_scan'))],
        ),
    ])
