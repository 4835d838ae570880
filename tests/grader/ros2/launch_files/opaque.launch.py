"""A function that sees the values and returns the nodes to start."""

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare


def start(context: LaunchContext, prefix, *, suffix):
    count = int(LaunchConfiguration("count").perform(context))
    share = FindPackageShare("demo").find("demo")
    return [
        Node(package="demo", executable="show", name=f"{prefix}{i}", arguments=[share.rsplit("/", 1)[1] + suffix])
        for i in range(count)
    ]


def nothing(context):
    assert context.launch_configurations["count"]


def generate_launch_description():
    return LaunchDescription(
        [
            DeclareLaunchArgument("count", default_value="2"),
            OpaqueFunction(function=nothing),
            OpaqueFunction(function=start, args=["robot"], kwargs={"suffix": "!"}),
        ]
    )
