"""A process that respawns, and one whose end ends the launch."""

from launch import LaunchDescription
from launch.actions import EmitEvent, ExecuteProcess, RegisterEventHandler, Shutdown, TimerAction
from launch.event_handlers import OnProcessExit
from launch.events import Shutdown as ShutdownEvent
from launch_ros.actions import Node


def generate_launch_description():
    required = ExecuteProcess(cmd=["sleep", "600"])
    return LaunchDescription(
        [
            Node(package="demo", executable="show", respawn=True, respawn_delay=0.05, respawn_max_retries=2),
            Node(package="demo", executable="wait", name="long", on_exit=Shutdown(reason="long is required")),
            RegisterEventHandler(
                OnProcessExit(target_action=required, on_exit=[EmitEvent(event=ShutdownEvent(reason="enough"))])
            ),
            required,
            TimerAction(period=1.0, actions=[Shutdown(reason="time is over")]),
        ]
    )
