"""How each patient of notebook 11 is seen to be well again: its node is run, and what it does is measured."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from typing import Any

from grader.words import say

Signs = Iterator[tuple[bool, str, str, str]]
"""For each sign: whether it is as it should be, what was seen, what was expected, and where to look next."""


def c1(patient: Any) -> Signs:
    """It takes the new limit."""
    with patient.run() as run:
        answer, v = run.set_speed(0.4), run.drive(2.0).v[-1]
    seen = say("asked for 0.4 m/s: {answer.message}; driven {v:.1f} m/s", answer=answer, v=v)
    look = say("which file does the node import?")
    yield bool(answer.success) and v > 0.39, seen, say("0.4 m/s accepted and driven"), look


def c2(patient: Any) -> Signs:
    """It drives, and stops before a wall."""
    with patient.run(world="wall_ahead") as run:
        run.set_speed(0.4)
        recording = run.drive(8.0)
    fastest, gap = max(recording.v), 2.0 - recording.x[-1]
    look = say("compare both ends of `scan` in `ros2 topic info -v`")
    seen = say("asked for 0.4 m/s, driven at most {fastest:.1f} m/s", fastest=fastest)
    yield fastest > 0.39, seen, say("0.4 m/s on a free way"), look
    look = say("what the node knows of a wall comes from `scan` alone")
    seen = say("the robot's centre {gap:.2f} m before the wall", gap=gap)
    yield gap > 0.3, seen, say("a stop 0.5 m before the wall"), look


def c3(patient: Any) -> Signs:
    """Its settings are the file's."""
    with patient.launched("launch", patient.name, "robot_controller_launch.py", nodes=2) as graph:
        value = graph.parameter("/robot_controller", "max_linear_speed")
    look = say("does the key of the file match the node's full name? And where does the node read the file?")
    seen = say("max_linear_speed is {value} after the launch", value=value or say("unknown"))
    yield value == "0.2", seen, say("0.2, as in the file"), look


def c4(patient: Any) -> Signs:
    """Its nodes have the contract's names."""
    with patient.launched("launch", patient.name, "robot_controller_launch.py", nodes=2) as graph:
        names = sorted(graph.nodes())
    wanted = ["/robot_controller", "/sensor_processor"]
    seen = say("nodes: {names}", names=", ".join(names) or say("none"))
    yield names == wanted, seen, ", ".join(wanted), say("who gives a node its name?")


def c5(patient: Any) -> Signs:
    """A namespace moves all its topics."""
    with patient.launched("run", patient.name, "sensor_processor", "--ros-args", "-r", "__ns:=/left", nodes=1) as graph:
        topics = graph.published("sensor_processor", "/left", count=2)
    wanted = ["/left/obstacle_distance", "/left/sensor_fusion_data"]
    look = say("which of the node's names did the namespace not move?")
    seen = say("in /left it publishes {topics}", topics=", ".join(topics) or say("nothing"))
    yield topics == wanted, seen, ", ".join(wanted), look


def c6(patient: Any) -> Signs:
    """It drives evenly, and not on old scans."""
    from sensor_msgs.msg import LaserScan

    with patient.run() as run:
        run.set_speed(0.3)
        recording = run.drive(5.0)
    slowest = min(v for t, v in zip(recording.t, recording.v, strict=True) if t > 1.5)
    look = say("which time does the node take for that of a scan? Print it beside the scan's stamp")
    seen = say("at 0.3 m/s it slows down to {slowest:.1f} m/s", slowest=slowest)
    yield slowest > 0.29, seen, say("0.3 m/s all the time"), look
    node = patient.bench("robot_controller.RobotController")
    node.ask("set_speed", speed=0.3)
    node.set_clock(10.9)
    old = [v for v, _ in [*node.hear("scan", LaserScan(), age=0.8), *node.advance(0.2)]]
    seen = say("after a scan of 0.8 s ago: {old:.1f} m/s", old=max(old))
    yield not any(old), seen, say("a stop: such a scan is too old"), look


def c7(patient: Any) -> Signs:
    """It arrives at goals ahead and behind."""
    for x, y in ((1.0, 0.2), (-1.0, 0.3)):
        with patient.run() as run:
            end = run.go_to(x, y, limit=20.0)
            gap = ((run.simulator.pose.x - x) ** 2 + (run.simulator.pose.y - y) ** 2) ** 0.5
        seen = say("the goal ({x:g}, {y:g}): {end.status}, {gap:.1f} m away", x=x, y=y, end=end, gap=gap)
        look = say("compare the yaw that the node computes with the true one, all the way round")
        yield end.status == "succeeded" and gap < 0.15, seen, say("succeeded, at most 0.15 m away"), look


def c8(patient: Any) -> Signs:
    """Its status comes at once."""
    node, times = patient.bench("robot_controller.RobotController"), []
    for _ in range(3):
        start = time.monotonic()
        node.ask("get_status")
        times.append(time.monotonic() - start)
    look = say("who could bring a newer pose while a callback waits for it?")
    seen = say("`get_status` takes {times} s", times=round(min(times), 1))
    yield min(times) < 0.2, seen, say("an answer at once"), look
    with patient.run() as run:
        run.set_speed(0.3)
        x = run.drive(3.0).x[-1]
        gap = abs(run.status().pose.position.x - x)
    seen = say("the pose of the status is {gap:.1f} m from the robot", gap=gap)
    yield gap < 0.1, seen, say("the last pose of `odom`"), look


def c9(patient: Any) -> Signs:
    """A goal can replace another."""
    with patient.run() as run:
        run.go_to(3.0, 0.0, limit=2.0)
        end = run.go_to(1.0, 0.5, limit=30.0)
        v = abs(run.drive(1.0).v[-1])
    look = say("write down, line by line, what `self._goal` is when the second goal comes in, and who writes it last")
    yield end.status == "succeeded", say("a goal that replaces another one: {end.status}", end=end), "succeeded", look
    seen = say("afterwards it drives at {v:.1f} m/s", v=v)
    yield v < 0.01, seen, say("a standstill: however a goal ends, the speed is 0"), look


def c10(patient: Any) -> Signs:
    """A changed rate is the rate."""
    with patient.run() as run:
        run.drive(0.5)
        for rate in (8.0, 10.0, 5.0):
            run.set_parameter("laser_processing_rate", rate)
        before = len(run.messages("cmd_vel"))
        run.drive(2.0)
        count = len(run.messages("cmd_vel")) - before
    look = say("count the node's timers after each change: `len(list(node.timers))` on a bench")
    seen = say("{count} commands in 2 s at 5 Hz", count=count)
    yield abs(count - 10) <= 1, seen, say("10, or one more or less"), look


SIGNS: dict[str, Callable[[Any], Signs]] = {
    function.__name__.upper(): function for function in (c1, c2, c3, c4, c5, c6, c7, c8, c9, c10)
}
