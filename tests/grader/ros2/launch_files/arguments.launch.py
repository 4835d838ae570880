"""Arguments, conditions on them, and configurations set on the way."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess, LogInfo, SetLaunchConfiguration
from launch.conditions import IfCondition, LaunchConfigurationEquals, UnlessCondition
from launch.substitutions import LaunchConfiguration, PythonExpression, TextSubstitution
from launch_ros.actions import Node

sim = LaunchConfiguration("sim")
robot = LaunchConfiguration("robot", default="tb4")


def show(word, **rest):
    return Node(package="demo", executable="show", arguments=[word], **rest)


def generate_launch_description():
    return LaunchDescription(
        [
            show(robot),
            DeclareLaunchArgument("sim", default_value="true", choices=["true", "false"]),
            DeclareLaunchArgument("robot", default_value=[TextSubstitution(text="robot_"), sim]),
            DeclareLaunchArgument("speed", default_value="0.5"),
            show(["sim:", sim], condition=IfCondition(sim)),
            show(["real:", sim], condition=UnlessCondition(sim)),
            show(robot),
            SetLaunchConfiguration("robot", "other"),
            show(robot, condition=LaunchConfigurationEquals("robot", "other")),
            show("never", condition=LaunchConfigurationEquals("robot", None)),
            show(PythonExpression([LaunchConfiguration("speed"), " * 2 + floor(1.5)"])),
            show("fast", condition=IfCondition(PythonExpression(["float('", LaunchConfiguration("speed"), "') > 1"]))),
            ExecuteProcess(cmd=["echo", ["a", "b"], robot], output="screen"),
            LogInfo(msg=["the robot is ", robot]),
        ]
    )
