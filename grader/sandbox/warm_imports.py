"""Import what nodes and their tests need, for processes that are forked later: half of a node's start.

Run by path, with `runpy`, in processes that have nothing else of the grader; imports nothing of it.
"""

from __future__ import annotations

import contextlib
import ctypes
import importlib
import inspect

# No module that draws numbers at random when it is imported, as numpy.random does: all forks would draw the same.
# And none by which a node could take itself for one under test, as unittest.mock.
MODULES = (
    "numpy", "yaml",
    "rclpy", "rclpy.action", "rclpy.callback_groups", "rclpy.duration", "rclpy.executors", "rclpy.logging",
    "rclpy.node", "rclpy.parameter", "rclpy.qos", "rclpy.time",
    "action_msgs.msg", "geometry_msgs.msg", "nav_msgs.msg", "rcl_interfaces.msg", "rcl_interfaces.srv",
    "rosgraph_msgs.msg", "sensor_msgs.msg", "std_msgs.msg", "std_srvs.srv",
)  # fmt: skip
# Types whose libraries it loads with them.
TYPES = {
    "geometry_msgs.msg": ("Pose", "Twist"), "nav_msgs.msg": ("Odometry",), "rcl_interfaces.msg": ("Log",),
    "rcl_interfaces.srv": ("GetParameters",), "rosgraph_msgs.msg": ("Clock",), "std_msgs.msg": ("Float32",),
    "sensor_msgs.msg": ("BatteryState", "Imu", "LaserScan"), "std_srvs.srv": ("Trigger",),
}  # fmt: skip
# Packages of the types that a node sends or receives, those of its parameters, its clock and its action included.
SERIALIZED = (
    "action_msgs", "builtin_interfaces", "geometry_msgs", "nav_msgs", "rcl_interfaces", "rosgraph_msgs", "sensor_msgs",
    "service_msgs", "std_msgs", "std_srvs", "type_description_interfaces", "unique_identifier_msgs",
)  # fmt: skip


def import_modules() -> None:
    """Import the modules and load the C code of the usual messages, as far as they are there."""
    for name in MODULES:
        with contextlib.suppress(ImportError):
            importlib.import_module(name)
    with contextlib.suppress(ImportError, AttributeError):
        check = importlib.import_module("rclpy.type_support").check_for_type_support
        for package, names in TYPES.items():
            for name in names:
                check(getattr(importlib.import_module(package), name))
    with contextlib.suppress(ImportError, AttributeError):
        importlib.import_module("rclpy.utilities").get_rmw_implementation_identifier()  # loads DDS
    for package in SERIALIZED:
        with contextlib.suppress(OSError):
            ctypes.CDLL(f"lib{package}__rosidl_typesupport_fastrtps_c.so")
    # For its first message, rclpy's logger asks `inspect` for its caller, which notes the path of each module: 10 ms.
    inspect.getmodule(import_modules.__code__)
