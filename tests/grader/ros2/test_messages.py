"""What `echo` and `param describe` print of a message. The expected texts are those of the real ros2cli 0.32.2."""

from __future__ import annotations

import pytest
import yaml

from grader.ros2.commands import Refusal, messages, param, topic

pytestmark = pytest.mark.ros
FULL = messages.FULL


def echoed(part):
    return topic.shown(part)


def test_a_long_last_text_is_cut_and_keeps_its_line_end():
    """Both end in three dots; the end mark of a YAML document was once taken off the text, with its line end."""
    from std_msgs.msg import String

    assert messages.to_yaml(String(data="x" * 128), FULL) == "data: " + "x" * 128 + "\n"
    assert messages.to_yaml(String(data="x" * 129), FULL) == "data: " + "x" * 128 + "...\n"
    assert messages.to_yaml(String(data="x" * 129)) == "data: " + "x" * 129 + "\n"
    assert messages.to_yaml("one", FULL) == "one\n"


def test_arrays_that_are_not_printed_are_named_by_type_and_length():
    from geometry_msgs.msg import PoseStamped
    from nav_msgs.msg import Path
    from sensor_msgs.msg import Imu, LaserScan

    def kinds(message):
        plain = yaml.safe_load(messages.to_yaml(message, FULL, arrays=False))
        return [value for value in plain.values() if str(value).startswith("<")]

    assert kinds(Path(poses=[PoseStamped()] * 3)) == ["<sequence type: geometry_msgs/msg/PoseStamped, length: 3>"]
    assert kinds(LaserScan(ranges=[1.0] * 200)) == [
        "<sequence type: float, length: 200>",
        "<sequence type: float, length: 0>",
    ]
    assert kinds(Imu()) == ["<array type: double[9]>"] * 3


def test_a_field_that_is_no_message_is_printed_as_python_does():
    from sensor_msgs.msg import LaserScan
    from std_msgs.msg import Byte

    scan = LaserScan(ranges=[0.5] * 130)
    assert echoed(messages.field(scan, "ranges")) == f"{scan.ranges}\n---"
    assert echoed(messages.field(scan, "header.frame_id")) == "\n---"
    assert echoed(messages.field(scan, "header.stamp")) == "sec: 0\nnanosec: 0\n---"
    assert echoed(Byte(data=b"A")) == "data: A\n---"
    for wrong in ("ranges[0]", "header.nope"):
        with pytest.raises(Refusal, match=f"Invalid field '{wrong[:6]}.*object has no attribute"):
            messages.field(scan, wrong)


def test_a_range_without_a_step_is_described_without_one():
    from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor

    speed = ParameterDescriptor(name="v", type=3, floating_point_range=[FloatingPointRange(to_value=0.5)])
    assert param.described(speed) == (
        "Parameter name: v\n  Type: double\n  Constraints:\n    Min value: 0.0\n    Max value: 0.5"
    )
    count = ParameterDescriptor(name="n", type=2, integer_range=[IntegerRange(to_value=9, step=3)])
    assert param.described(count).endswith("    Max value: 9\n    Step: 3")


def test_a_list_is_shown_as_in_the_message():
    from rcl_interfaces.msg import ParameterValue

    assert param.shown(ParameterValue(type=8, double_array_value=[1.0])) == "Double values are: array('d', [1.0])"
    assert param.shown(ParameterValue(type=1, bool_value=True)) == "Boolean value is: True"
