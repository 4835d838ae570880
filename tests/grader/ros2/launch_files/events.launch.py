"""One thing after another: timers and events run in the state outside their group."""
# ruff: noqa: ARG005 - as launch files are written

from launch import LaunchDescription
from launch.actions import GroupAction, LogInfo, RegisterEventHandler, SetLaunchConfiguration, TimerAction
from launch.event_handlers import OnProcessExit, OnProcessStart, OnShutdown
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node, PushRosNamespace


def show(*words, **rest):
    return Node(package="demo", executable="show", arguments=list(words), **rest)


def generate_launch_description():
    first = show("first", output="screen")
    last = show("last")
    return LaunchDescription(
        [
            RegisterEventHandler(OnProcessStart(target_action=first, on_start=[LogInfo(msg="first has started")])),
            RegisterEventHandler(
                OnProcessExit(target_action=first, on_exit=[LogInfo(msg="first has ended"), show("second")])
            ),
            RegisterEventHandler(OnShutdown(on_shutdown=lambda event, context: LogInfo(msg=f"bye: {event.reason}"))),
            LogInfo(msg="hello"),
            GroupAction(
                [
                    PushRosNamespace("inside"),
                    SetLaunchConfiguration("x", "inside"),
                    show("now", LaunchConfiguration("x", default="outside")),
                    TimerAction(period=0.4, actions=[show("later", LaunchConfiguration("x", default="outside"))]),
                ]
            ),
            first,
            TimerAction(period=0.8, actions=[last]),
        ]
    )
