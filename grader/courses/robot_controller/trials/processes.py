"""Trials of the nodes as processes, beside the stock ones; and of the demonstration."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from grader.trials.catalog import trial
from grader.trials.plan import NAMESPACE
from sim.sensors import ScanReading

from .between import at_rest

if TYPE_CHECKING:
    from grader.trials.stage import Stage

NODES = ("robot_controller", "sensor_processor")
ASKED = ("set_speed", "get_status", "navigate_to_position/_action/send_goal")
_DEMO_LIMIT_S = 60.0  # the robot crosses its world in less


@trial(serves=["F1"])
def idle_robot_controller(stage: Stage) -> None:
    """Wait five seconds without a command; the lidar starts after one second."""
    stage.mute(ScanReading)
    stage.run(1.0)
    stage.unmute(ScanReading)
    stage.mark("scans")
    stage.run_timed("waited", 4.0)
    stage.record_graph("scan", "odom", "cmd_vel")


@trial(serves=["I4", "I5"], launch="remapping_launch.py", awaits=NODES, namespace=NAMESPACE, mostly_waits=True)
def launch_remapped(stage: Stage) -> None:
    """Run the grader's own launch file, which remaps topics of both nodes in a namespace."""
    stage.refresh_graph()  # names that should not be there may be discovered last
    stage.record_graph(f"{NAMESPACE}/base/cmd_vel", f"{NAMESPACE}/front/scan", f"{NAMESPACE}/odom")
    stage.record_graph_of("sensor_processor", f"{NAMESPACE}/front/scan", f"{NAMESPACE}/front/distance")


@trial(mostly_waits=True)
def standing_clock_robot_controller(stage: Stage) -> None:
    """Speed up twice, at two paces of the wall clock; then stop the clock as the robot drives."""
    stage.run(0.5)
    stage.call("set_speed", speed=0.5)
    stage.mark("fast")
    stage.run_timed("waited", 0.8)
    stage.call("set_speed", speed=0.0)
    stage.run(0.5)
    stage.call("set_speed", speed=0.5)  # the same again, while the wall clock runs ahead of the simulated one
    stage.mark("slow")
    stage.run_slowly(0.8)
    stage.measured["held"] = stage.freeze_clock(1.0)
    stage.run(1.0)


@trial(serves=["I8"], follows="standing_clock_robot_controller", at_rest=at_rest)
def interrupted_driving(stage: Stage) -> None:
    """Press Ctrl-C while the robot is driving."""
    stage.run(0.3)
    if stage.call("set_speed", speed=0.375).problem:
        stage.set_parameter("speed", 0.375)  # how notebook 05 drives, before there is a service
    stage.run(1.5)
    stage.interrupt()


@trial(serves=["I8"], mostly_waits=True)
def interrupted_navigating(stage: Stage) -> None:
    """Press Ctrl-C while the robot is driving to a goal."""
    stage.run(0.3)
    pose = stage.simulator.odometry().pose
    stage.navigate(pose.x + 3.0 * math.cos(pose.yaw), pose.y + 3.0 * math.sin(pose.yaw))
    stage.run(1.5)
    stage.interrupt()


# Calls and goals go through the observer: otherwise it could not see them and would have to believe the script.
@trial(
    serves=["Q6"],
    world="open_field",  # the script may drive anywhere
    beside={"sensor_processor": {"raw_scan": "scan"}},
    remappings={name: f"behind/{name}" for name in ASKED},
    real_time=True,
    shows_source=True,
)
def demo(stage: Stage) -> None:
    """Run the package's demonstration script against both nodes, in real time."""
    stage.proxy_services(ASKED)
    stage.watch_goals()
    stage.run(0.5)
    script = stage.run_script("scripts/demo.py")
    stage.run_until(lambda: script.exit_code() is not None, _DEMO_LIMIT_S)
    stage.run(0.2)
