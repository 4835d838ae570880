"""The first error of a build's log, with its explanation and without our paths."""

from __future__ import annotations

from pathlib import Path

import pytest

from grader.checks.build_log import find_error

LOGS = Path(__file__).parent / "build_logs"


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
    assert find_error(log).said == error


@pytest.mark.parametrize(
    ("name", "said", "cure"),
    [
        ("cmake_typo", 'CMakeLists.txt:6 (find_pakage): Unknown CMake command "find_pakage"', "is find_package meant?"),
        ("cmake_unclosed", 'CMakeLists.txt:10: Parse error.  Function missing ending ")"', "never closed"),
        ("no_find_rosidl", "CMakeLists.txt:9 (rosidl_generate_interfaces): Unknown CMake command",
         "find_package(rosidl_default_generators REQUIRED)"),
        ("no_find_geometry", "CMakeLists.txt:9 (rosidl_generate_interfaces)", "find_package(geometry_msgs REQUIRED)"),
        ("no_dependencies", "does not name geometry_msgs", "DEPENDENCIES geometry_msgs as the last line"),
        ("no_group", "CMakeLists.txt:10 (rosidl_generate_interfaces)", "to package.xml, before <export>"),
        ("wrong_msg_name", "CMakeLists.txt:10 (rosidl_generate_interfaces)", "write srv/SetSped.srv, or correct"),
        ("msg_syntax", "Error processing 'flot32 speed'", "correct the line `flot32 speed` of SetSpeed"),
        ("srv_no_dashes", "Could not find separator '---'", "a .srv has one line ---"),
        ("action_one_dash", "Number of '---' separators", "an .action two"),
        ("install_missing_program", "install() names scripts/robot_controler, which is not there", "take its name out"),
        ("rclcpp", "CMakeLists.txt:6: it asks for `rclcpp`, which is for C++; this kit is for Python only",
         "remove find_package(rclcpp ...) from CMakeLists.txt and rclcpp from package.xml"),
        ("interfaces_missing", "CMakeLists.txt:6: it asks for `ros2_robot_controller_interfaces`, a package of interf",
         "hand its interfaces in with the package"),
        ("xml_broken", "Error parsing 'package.xml': mismatched tag: line 14, column 20", "each <tag> needs"),
        ("xml_no_version", 'The manifest must contain exactly one "version" tag', "line by line"),
        ("install_python_pkg", "ament_python_install_package() and rosidl_generate_interfaces() both make",
         "install(DIRECTORY ${PROJECT_NAME}/ DESTINATION"),
        ("no_project", "'Project' is an invalid package name", "project(NAME), with the name in package.xml"),
        ("cpp_target", "CMakeLists.txt:45 (add_executable): Cannot find source file: src/talker.cpp", "are in Python"),
        ("py_no_resource", "can't copy 'resource/ros2_robot_controller'", "write resource/ros2_robot_controller"),
        ("py_setup_syntax", "setup.py:20: invalid syntax", ""),
        ("py_import_error", "setup.py:1: No module named 'catkin'", ""),
    ],
)  # fmt: skip
def test_a_recorded_build_is_explained_by_its_first_error(name: str, said: str, cure: str):
    """The student's file and line, not those of ROS's own files; no traceback; and what to do about it."""
    error = find_error((LOGS / f"{name}.txt").read_text())
    assert said in error.said
    assert cure in error.cure
    assert "<ros>" not in error.said
    assert "Traceback" not in error.said


def test_every_recorded_build_is_in_the_table():
    table = next(mark for mark in test_a_recorded_build_is_explained_by_its_first_error.pytestmark)
    assert {path.stem for path in LOGS.glob("*.txt")} == {name for name, _, _ in table.args[1]}
