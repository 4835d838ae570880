"""One thing after another: timers and events run in the state outside their group."""
# ruff: noqa: ARG005 - as launch files are written

from launch import LaunchDescription
from launch.actions import GroupAction, LogInfo, RegisterEventHandler, SetLaunchConfiguration, TimerAction
from launch.event_handlers import OnExecutionComplete, OnProcessExit, OnProcessIO, OnProcessStart, OnShutdown
from launch.substitutions import LaunchConfiguration, LocalSubstitution
from launch_ros.actions import Node, PushRosNamespace


def show(*words, **rest):
    return Node(package="demo", executable="show", arguments=list(words), **rest)


def generate_launch_description():
    first = show("first", output="screen")
    last = show("last")
    hello = LogInfo(msg="hello")
    return LaunchDescription(
        [
            RegisterEventHandler(OnProcessStart(target_action=first, on_start=[LogInfo(msg="first has started")])),
            RegisterEventHandler(
                OnProcessExit(target_action=first, on_exit=[LogInfo(msg="first has ended"), show("second")])
            ),
            RegisterEventHandler(
                OnProcessIO(
                    target_action=first,
                    on_stdout=lambda event: LogInfo(msg=f"first says {event.text.decode().split()[0]}"),
                )
            ),
            RegisterEventHandler(
                OnExecutionComplete(target_action=hello, on_completion=lambda event, context: LogInfo(msg="greeted"))
            ),
            RegisterEventHandler(OnShutdown(on_shutdown=[LogInfo(msg=["bye: ", LocalSubstitution("event.reason")])])),
            hello,
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
