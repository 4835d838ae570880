"""The first error of a build's log, with its explanation and without our paths."""

from __future__ import annotations

import pytest

from grader.checks.build_log import first_error


@pytest.mark.parametrize(
    ("log", "error"),
    [
        ("--- output\nCMake Error at CMakeLists.txt:9 (find_package):\n  By not providing\n\n  more\nnext\nError 2\n",
         "CMake Error at CMakeLists.txt:9 (find_package): By not providing more"),
        ("x\nError parsing 'submission/package.xml':\nThe manifest must contain a name\ny\n",
         "Error parsing 'package.xml': The manifest must contain a name"),
        ("CMake Error at <ros>/adapt.cmake:57 (message):\n  execute_process(<ros>/python3 -m rosidl_adapter)\n"
            "  returned error code 1:\n\n  Error processing 'flot32 x' of 'msg/A.msg'\n",
         "Error processing 'flot32 x' of 'msg/A.msg'"),
        ("CMake Error in '/ws/src/ros2_robot_controller//package.xml'\n", "CMake Error in 'package.xml'"),
        ("Summary: 1 package finished\n", ""),
    ],
)  # fmt: skip
def test_the_first_error_has_its_explanation_and_no_path_of_ours(log: str, error: str):
    assert first_error(log) == error
