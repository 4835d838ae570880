"""What a node says before the observer is matched is not lost where ROS keeps it."""

from __future__ import annotations

import os
import time
from typing import Any

import pytest
import rclpy
from rcl_interfaces.msg import Log
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor

from grader.trials.messages import LOG_QOS, set_back

pytestmark = pytest.mark.ros

DOMAIN = 60 + os.getpid() % 40


def test_a_warning_logged_before_the_subscription_is_matched_is_still_read():
    """F12 once read "0 warnings": the subscription was volatile, and its match came after the trial was over."""
    context = Context()
    rclpy.init(context=context, domain_id=DOMAIN)
    talker = rclpy.create_node("talker", context=context)
    talker.get_logger().warning("battery low")
    heard: list[str] = []

    def hear(message: Any) -> None:
        heard.append(message.msg)

    listener = rclpy.create_node("listener", context=context, enable_rosout=False)
    listener.create_subscription(Log, "/rosout", hear, LOG_QOS)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(listener)
    deadline = time.monotonic() + 30.0
    while not heard and time.monotonic() < deadline:
        executor.spin_once(timeout_sec=0.1)
    executor.shutdown()
    context.try_shutdown()
    assert heard == ["battery low"]


def test_stamps_are_those_of_a_run_that_began_with_the_trial():
    """A trial that goes on with a running node begins seconds after ROS time 100 s."""
    fused = {"header": {"stamp": {"sec": 107, "nanosec": 300_000_000}, "frame_id": "base_link"}}
    set_back(fused, 7.25)
    assert fused["header"]["stamp"] == {"sec": 100, "nanosec": 50_000_000}
    other = {"header": "none"}
    set_back(other, 7.25)
    assert other == {"header": "none"}
