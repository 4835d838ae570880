"""What runs around the notebooks' experiments: somebody who sends, listens or cancels while a node is looked at."""

from __future__ import annotations

import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from functools import partial
from typing import Any

from grader.host import dds_sockets
from grader.words import mark, say

_PATIENCE_S = 10.0


def feed_scans(node: Any, count: int = 15, rate: float = 10.0, topic: str = "lesson_scan") -> None:
    """Spin the node while a lidar, a thread of its own, sends so many empty scans."""
    import rclpy
    from rclpy.qos import qos_profile_sensor_data
    from sensor_msgs.msg import LaserScan

    lidar = rclpy.create_node("lidar", enable_rosout=False)
    publisher = lidar.create_publisher(LaserScan, topic, qos_profile_sensor_data)

    def send() -> None:
        _wait(lambda: publisher.get_subscription_count() > 0)
        for _ in range(count):
            scan = LaserScan()
            scan.header.stamp = lidar.get_clock().now().to_msg()
            publisher.publish(scan)
            time.sleep(1.0 / rate)

    sender = threading.Thread(target=send)
    sender.start()
    while sender.is_alive():
        rclpy.spin_once(node, timeout_sec=0.1)
    node.destroy_node()
    lidar.destroy_node()


def timeline(*nodes: Any) -> list[tuple[str, float, float, float]]:
    """Spin each node while a lidar sends it 15 scans on its `scan`; plot when each callback ran and what waited.

    `nodes` are classes. Returns for each call the callback's name, the seconds at which its scan was measured (or at
    which it began), it began and it ended.
    """
    import matplotlib.pyplot as plt

    figure, plots = plt.subplots(len(nodes), 1, figsize=(9, 1.7 * len(nodes)), sharex=True, layout="constrained")
    calls: list[tuple[str, float, float, float]] = []
    for kind, axes in zip(nodes, plots if len(nodes) > 1 else [plots], strict=True):
        node = kind(namespace="/timeline")
        noted = _note_calls(node)
        feed_scans(node, topic="/timeline/scan")
        begun = min((call[1] for call in noted), default=0.0)
        names = list(dict.fromkeys(name for name, *_ in noted))
        for name, measured, start, end in noted:
            row = names.index(name)
            axes.barh(row, start - measured, 0.5, measured - begun, color="#E69F00", alpha=0.5)
            axes.barh(row, max(end - start, 0.006), 0.5, start - begun, color="#0072B2", edgecolor="white", lw=0.5)
        axes.set(yticks=range(len(names)), yticklabels=names, title=kind.__name__)
        axes.invert_yaxis()
        calls += noted
    figure.supxlabel(say("wall time (s): blue, the callback runs; orange, its scan waits"))
    return calls


def _note_calls(node: Any) -> list[tuple[str, float, float, float]]:
    """Return a list to which each call of the node's timers and subscriptions will be added."""
    noted: list[tuple[str, float, float, float]] = []

    def wrap(callback: Callable[..., Any]) -> Callable[..., Any]:
        def call(*message: Any) -> None:
            start = time.time()
            stamp = message[0].header.stamp if message else None
            callback(*message)
            measured = stamp.sec + stamp.nanosec * 1e-9 if stamp is not None else start
            noted.append((callback.__name__, measured, start, time.time()))

        return call

    for waitable in (*node.timers, *(s for s in node.subscriptions if s.topic_name.endswith("/scan"))):
        waitable.callback = wrap(waitable.callback)
    return noted


def last_words(script: str) -> tuple[float | None, str]:
    """Start a script that publishes Twists on `lesson_cmd_vel`, interrupt it between two of them as Ctrl-C does.

    Returns the last speed that was heard (m/s), and the last line that it has printed.
    """
    import rclpy
    from geometry_msgs.msg import Twist

    heard: list[float] = []
    listener = rclpy.create_node("listener", enable_rosout=False)

    def note(twist: Any) -> None:
        heard.append(twist.linear.x)

    listener.create_subscription(Twist, "lesson_cmd_vel", note, 10)
    process = subprocess.Popen([sys.executable, script], stderr=subprocess.PIPE, text=True)

    def spin(until: Callable[[], bool], seconds: float) -> None:
        end = time.monotonic() + seconds
        while not until() and time.monotonic() < end:
            rclpy.spin_once(listener, timeout_sec=0.05)

    spin(lambda: len(heard) >= 5, _PATIENCE_S)
    time.sleep(0.04)
    with dds_sockets.deaf_to_the_graph():
        process.send_signal(signal.SIGINT)
        complaint = process.communicate()[1].strip().splitlines()
        spin(lambda: False, 0.3)
    listener.destroy_node()
    return (heard[-1] if heard else None), (complaint[-1] if complaint else "")


class Handle:
    """Stands for rclpy's goal handle on a bench: it has the goal's `request`, and notes what the server says.

    Attributes:
        said: "succeed", "canceled", "abort", in the order of the calls.
        told: the distances of the feedback, in metres.
    """

    def __init__(self, x: float, y: float, tolerance: float = 0.1) -> None:
        self.request = _action().Goal(tolerance=tolerance)
        self.request.target_pose.position.x, self.request.target_pose.position.y = x, y
        self.is_cancel_requested = False
        self.said: list[str] = []
        self.told: list[float] = []
        self.succeed, self.canceled, self.abort = (
            partial(self.said.append, word) for word in ("succeed", "canceled", "abort")
        )

    def publish_feedback(self, feedback: Any) -> None:
        """Note the distance."""
        self.told.append(round(feedback.distance_remaining, 3))


def _action() -> Any:
    """Return the action's type, as the kit has built it."""
    from grader.notebook import interface_types, workspace

    interface_types.load(workspace.find())
    from grader.trials.messages import interface

    return interface(next(type_ for node in workspace.course().nodes.values() for type_ in node.actions.values()))


def send_and_cancel(execute: Callable[..., Any], **options: Any) -> str:
    """Serve an action with `execute(server, goal)`; send a goal, cancel it after a second, and say what was seen.

    The server is a node in a thread of its own: it counts odometry (20 messages come in that second), and a timer
    completes the future `server.over` after two seconds of a goal, or when a cancel is requested.
    `options` are those of ActionServer.
    """
    import rclpy
    from nav_msgs.msg import Odometry
    from rclpy.action.client import ActionClient
    from rclpy.executors import SingleThreadedExecutor

    server, done = _server(execute, options), threading.Event()

    def serve() -> None:
        executor = SingleThreadedExecutor()
        executor.add_node(server)
        while not done.is_set():
            executor.spin_once(timeout_sec=0.1)
        executor.shutdown()

    thread = threading.Thread(target=serve)
    thread.start()
    me = rclpy.create_node("me", enable_rosout=False)
    client = ActionClient(me, server.type, "lesson_go")
    odometry = me.create_publisher(Odometry, "lesson_odom", 10)

    def wait(future: Any) -> Any:
        rclpy.spin_until_future_complete(me, future, timeout_sec=_PATIENCE_S)
        return future.result()

    try:
        client.wait_for_server(timeout_sec=_PATIENCE_S)
        _wait(lambda: odometry.get_subscription_count() > 0)
        goal = wait(client.send_goal_async(server.type.Goal()))
        before = server.heard
        for _ in range(20):
            odometry.publish(Odometry())
            time.sleep(0.05)
        heard = server.heard - before
        taken = bool(wait(goal.cancel_goal_async()).goals_canceling)
        status = {4: "succeeded", 5: "canceled", 6: "aborted"}.get(wait(goal.get_result_async()).status, "unknown")
    finally:
        done.set()
        thread.join()
        client.destroy()
        server.action.destroy()
        me.destroy_node()
        server.destroy_node()
    answer = say("taken") if taken else say("refused")
    words = mark("{heard} of 20 odometry messages, cancel {answer}, the goal {status}")
    return say(words, heard=heard, answer=answer, status=status)


def _server(execute: Callable[..., Any], options: dict[str, Any]) -> Any:
    from nav_msgs.msg import Odometry
    from rclpy.action.server import ActionServer
    from rclpy.node import Node
    from rclpy.task import Future

    action = _action()

    class Server(Node):
        type = action

        def __init__(self) -> None:
            super().__init__("server", enable_rosout=False)
            self.heard, self.ticks = 0, 0
            self.goal: Any = None
            self.over: Any = Future()
            self.create_subscription(Odometry, "lesson_odom", self.on_odom, 10)
            self.create_timer(0.1, self.tick)
            # A partial, not a lambda: that would hide from rclpy that a function is async.
            self.action = ActionServer(self, action, "lesson_go", partial(execute, self), **options)

        def on_odom(self, _odom: Any) -> None:
            self.heard += 1

        def tick(self) -> None:
            if self.goal is not None and not self.over.done():
                self.ticks += 1
                if self.ticks == 20 or self.goal.is_cancel_requested:
                    self.over.set_result(None)

    return Server()


def _wait(until: Callable[[], bool]) -> None:
    end = time.monotonic() + _PATIENCE_S
    while not until() and time.monotonic() < end:
        time.sleep(0.01)
