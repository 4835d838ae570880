"""Run a course package on a TurtleBot 4: its two nodes in a namespace of their own, and the adapter beside them.

ros2 launch turtlebot4_launch.py
ros2 launch turtlebot4_launch.py namespace:=/robot1 max_linear_speed:=0.15
"""

from __future__ import annotations

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import EnvironmentVariable, LaunchConfiguration
from launch_ros.actions import Node

PACKAGE = "ros2_robot_controller"
ARGUMENTS = [
    DeclareLaunchArgument(
        "namespace",
        default_value=EnvironmentVariable("ROBOT_NAMESPACE", default_value=""),
        description="The robot's namespace.",
    ),
    DeclareLaunchArgument(
        "max_linear_speed", default_value="0.306", description="The base drives no faster by default, m/s."
    ),
    DeclareLaunchArgument(
        "emergency_stop_distance",
        default_value="0.25",
        description="From the lidar, m; the bumper of a Standard is 0.21 m in front of it.",
    ),
    DeclareLaunchArgument(
        "laser_yaw", default_value="1.5708", description="How far the lidar is turned to the left, rad."
    ),
    DeclareLaunchArgument("use_sim_time", default_value="false", description="Follow /clock: never on a robot."),
]


def nodes(context: LaunchContext) -> list[Node]:
    """Return the package's nodes below the robot's namespace, with the names of the robot's topics."""
    name = context.launch_configurations["namespace"].strip("/")
    robot = f"/{name}" if name else ""
    course = f"{robot}/course"  # the base has a navigate_to_position of its own in the robot's namespace
    config = Path(get_package_share_directory(PACKAGE), "config")
    clock = {"use_sim_time": LaunchConfiguration("use_sim_time")}
    limits = {limit: LaunchConfiguration(limit) for limit in ("max_linear_speed", "emergency_stop_distance")}
    return [
        Node(
            package=PACKAGE,
            executable="robot_controller",
            name="robot_controller",
            namespace=course,
            parameters=[str(config / "robot_params.yaml"), limits, clock],
            remappings=[("odom", f"{robot}/odom")],
            output="screen",
        ),
        Node(
            package=PACKAGE,
            executable="sensor_processor",
            name="sensor_processor",
            namespace=course,
            parameters=[str(config / "sensor_params.yaml"), clock],
            remappings=[
                ("raw_scan", "scan"),
                ("imu/data", f"{robot}/imu"),
                ("battery/state", f"{robot}/battery_state"),
            ],
            output="screen",
        ),
        Node(
            executable="python3",
            arguments=[str(Path(__file__).resolve().with_name("adapter.py"))],
            name="turtlebot4_adapter",
            namespace=course,
            parameters=[{"laser_yaw": LaunchConfiguration("laser_yaw")}, clock],
            remappings=[("robot/scan", f"{robot}/scan"), ("robot/cmd_vel", f"{robot}/cmd_vel")],
            output="screen",
        ),
    ]


def generate_launch_description() -> LaunchDescription:
    """Return the arguments and, once they are known, the nodes."""
    return LaunchDescription([*ARGUMENTS, OpaqueFunction(function=nodes)])
