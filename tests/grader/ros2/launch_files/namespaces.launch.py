"""Namespaces of nodes, of groups, and both; settings for all nodes of a group."""

from launch import LaunchDescription
from launch.actions import GroupAction
from launch_ros.actions import Node, PushRosNamespace, SetParameter


def show(**rest):
    return Node(package="demo", executable="show", **rest)


def generate_launch_description():
    return LaunchDescription(
        [
            show(namespace="robot1", name="n"),
            show(namespace="/robot1/", name="n"),
            show(namespace=""),
            GroupAction(
                [
                    PushRosNamespace("fleet"),
                    SetParameter("use_sim_time", True),
                    show(name="n"),
                    show(namespace="robot2", remappings=[("odom", "wheel/odom")]),
                    show(namespace="/other", parameters=[{"a": 1}], name="n"),
                    GroupAction([PushRosNamespace(namespace="deep"), SetParameter(name="k", value=2.5), show()]),
                ]
            ),
            show(name="n"),
        ]
    )
