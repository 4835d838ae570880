"""Messages with fields in another order than the contract's are read in the submission's order."""

from __future__ import annotations

import struct
from types import SimpleNamespace

import pytest

from grader.trials.messages import reader

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
