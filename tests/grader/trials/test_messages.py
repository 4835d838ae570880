"""Messages as plain values: in the submission's order of fields, by the trial's time, and those before the match."""

from __future__ import annotations

import os
import struct
import time
from types import SimpleNamespace
from typing import Any

import pytest
import rclpy
from rcl_interfaces.msg import Log
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor

from grader.trials.messages import LOG_QOS, reader, set_back

DOMAIN = 60 + os.getpid() % 40
CONTRACT = SimpleNamespace(
    get_fields_and_field_types=lambda: {"header": "std_msgs/Header", "distance": "float", "battery": "float"}
)
HEADER = struct.pack("<4siI I10s2x", b"\0\1\0\0", 7, 500, 10, b"base_link\0")


def test_exchanged_fields_are_read_by_their_names():
    read = reader("std_msgs/Header header\nfloat32 battery  # percent\nfloat32 distance\n", CONTRACT)
    assert read is not None
    assert read(HEADER + struct.pack("<ff", 99.0, 1.5)) == {
        "header": {"stamp": {"sec": 7, "nanosec": 500}, "frame_id": "base_link"},
        "battery": 99.0,
        "distance": 1.5,
    }


def test_a_number_of_another_size_is_read_in_that_size():
    read = reader("std_msgs/msg/Header header\nfloat64 distance\nfloat32 battery\n", CONTRACT)
    assert read is not None
    found = read(HEADER + struct.pack("<df", 1.5, 99.0))
    assert (found["distance"], found["battery"]) == (1.5, 99.0)


@pytest.mark.parametrize(
    "text",
    [
        "std_msgs/Header header\nfloat32 distance\nfloat32 battery\n",
        "std_msgs/Header header\nfloat32 distance\nfloat32 battery_level\n",
        "std_msgs/Header header\nfloat32 distance\n",
        "std_msgs/Header header\nfloat32 battery\nstring distance\n",
        "std_msgs/Header header\nfloat32[3] battery\nfloat32 distance\n",
        "std_msgs/Header header\nint32 A=1\nfloat32 battery\nfloat32 distance\n",
        "geometry_msgs/Vector3 header\nfloat32 battery\nfloat32 distance\n",
        "int8 header\nfloat32 battery\nfloat32 distance\n",
        "",
        "\x00\x1b[31m",
    ],
    ids=[
        "the contract's", "renamed", "left out", "a string", "an array", "a constant", "no header", "a number", "empty",
        "garbage",
    ],
)  # fmt: skip
def test_any_other_definition_is_read_by_the_contracts_type(text: str):
    assert reader(text, CONTRACT) is None


@pytest.mark.parametrize("data", [b"", b"\0\1\0\0", HEADER])
def test_bytes_that_are_not_such_a_message_are_none(data: bytes):
    read = reader("std_msgs/Header header\nfloat32 battery\nfloat32 distance\n", CONTRACT)
    assert read is not None
    assert read(data) is None


def test_a_long_string_is_cut_like_any_other():
    read = reader("std_msgs/Header header\nfloat32 battery\nfloat32 distance\n", CONTRACT)
    assert read is not None
    found = read(struct.pack("<4siII", b"\0\1\0\0", 7, 500, 50_000) + b"x" * 49_999 + b"\0" + struct.pack("<ff", 1, 2))
    assert found is not None
    assert len(found["header"]["frame_id"]) == 2000


@pytest.mark.ros
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
