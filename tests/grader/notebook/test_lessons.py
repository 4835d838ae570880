"""The experiments around the notebooks' nodes."""

from __future__ import annotations

import time
from typing import Any

import matplotlib.pyplot as plt
import pytest
import rclpy
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import LaserScan

from grader.courses.robot_controller.lessons.lessons import timeline

pytestmark = pytest.mark.ros


class Sleeper(Node):
    def __init__(self, **options: Any) -> None:
        super().__init__("sleeper", **options)
        self.create_subscription(LaserScan, "scan", self.on_scan, qos_profile_sensor_data)
        self.create_timer(0.1, self.work)

    def on_scan(self, _scan: LaserScan) -> None:
        pass

    def work(self) -> None:
        time.sleep(0.3)


def test_a_timeline_shows_which_scan_waits_for_which_callback():
    rclpy.init()
    try:
        calls = timeline(Sleeper)
    finally:
        rclpy.try_shutdown()
        plt.close("all")
    slept = [(start, end) for name, _, start, end in calls if name == "work"]
    waited = [start - measured for name, measured, start, _ in calls if name == "on_scan"]
    assert all(end - start >= 0.29 for start, end in slept)
    assert max(waited) >= 0.2, "a scan waits while the timer's callback sleeps"
