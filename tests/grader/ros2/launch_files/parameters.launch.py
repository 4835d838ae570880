"""Parameters as dictionaries, files, and values with a given type."""

from pathlib import Path

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterFile, ParameterValue

n = LaunchConfiguration("n")


def generate_launch_description():
    config = Path(__file__).parent / "config"
    wild = config / "wild.yaml"
    return LaunchDescription(
        [
            DeclareLaunchArgument("n", default_value="10"),
            Node(
                package="demo",
                executable="show",
                name="typed",
                namespace="ns",
                parameters=[
                    {"text": "10", "number": n, "joined": [n, "_x"], "said": ParameterValue(n, value_type=str)},
                    {"outer": {"inner": 1, "deep": {"er": True}}, "mixed": [1, 2.5], "words": ["a", "b"]},
                ],
            ),
            Node(
                package="demo",
                executable="show",
                parameters=[
                    str(config / "wild.yaml"),
                    {"a": 1.0, "on": LaunchConfiguration("flag", default="on")},
                    config / "missing.yaml",
                ],
            ),
            Node(
                package="demo",
                executable="show",
                parameters=[ParameterFile(wild)],
            ),
        ]
    )
