"""Where a program of the submission stopped, by what Python printed."""

from __future__ import annotations

import pytest
from helpers import beside

from grader import tracebacks

TEXTS = beside(__file__)

SITE = "/ws/install/lib/python3.11/site-packages/ros2_robot_controller"
CRASH = TEXTS["CRASH"]
COLLECTED = TEXTS["COLLECTED"]
SENT = (
    TEXTS["ASSERTION"]
    .replace("ros2_robot_controller__srv__get_robot_status__response", "geometry_msgs__msg__vector3")
    .replace('rclpy/service.py", line 78 in send_response', 'rclpy/publisher.py", line 75 in publish')
    .replace('utils/running.py", line 45 in spin_until', 'driver.py", line 117 in _publish')
)
# What rclpy prints last where one callback raised and another was under way: F6 was charged with these words.
NOT_RETRIEVED = (
    "The following exception was never retrieved: cannot use Destroyable because destruction was requested\n"
)


@pytest.mark.parametrize(
    ("output", "said"),
    [
        (CRASH, "KeyError: 'left' (ros2_robot_controller/driver.py:88, in `_control`)"),
        (CRASH + COLLECTED, "KeyError: 'left' (ros2_robot_controller/driver.py:88, in `_control`)"),
        (CRASH + 2 * NOT_RETRIEVED, "KeyError: 'left' (ros2_robot_controller/driver.py:88, in `_control`)"),
        (f"up\n{NOT_RETRIEVED}", NOT_RETRIEVED.strip()),
        ("up\n\n", "up"),
        ("", ""),
        (
            TEXTS["ASSERTION"],
            "Assertion `PyFloat_Check(field)' failed. A value in get_robot_status (response) is not of the field's "
            "type, float; look at what the callback of this service puts into its response",
        ),
        (
            SENT,
            "Assertion `PyFloat_Check(field)' failed. A value in vector3 is not of the field's type, float "
            "(ros2_robot_controller/driver.py:117, in `_publish`)",
        ),
        (
            TEXTS["CALLED"],
            "TypeError: 'NoneType' object is not callable: a callback is None; name it without brackets, `self.tick`, "
            "not `self.tick()`",
        ),
        ("ModuleNotFoundError: No module named 'scipy'\n", "ModuleNotFoundError: No module named 'scipy'"),
    ],
)
def test_last_words_name_the_line_of_the_package_where_there_is_one(output: str, said: str):
    assert tracebacks.last_words(output) == said


def test_a_dump_of_all_threads_shows_the_innermost_line_of_the_package():
    assert tracebacks.hanging_place(TEXTS["HANG"]) == "ros2_robot_controller/speed_server.py:41, in `_on_set_speed`"
    assert tracebacks.hanging_place(CRASH) == ""
