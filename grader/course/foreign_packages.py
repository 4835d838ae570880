"""What to say of a package that a submission asks for and that is not here."""

from __future__ import annotations

import re

_CPP = re.compile(r"rclcpp\w*|\w+_cpp|ament_cmake_auto|pluginlib|class_loader|Eigen3|PCL|pcl_\w+|OpenCV|tf2_eigen")


_PORT = "write it with rclpy: a class derived from rclpy.node.Node, and rclpy.spin in main()"
ROS_1 = {
    **dict.fromkeys(("rospy", "roslib", "actionlib", "dynamic_reconfigure"), _PORT),
    "catkin": "find_package(ament_cmake REQUIRED) and ament_package() instead",
    "genmsg": "rosidl_default_generators makes interfaces in ROS 2",
    "message_generation": "rosidl_default_generators makes interfaces in ROS 2",
    "message_runtime": "rosidl_default_runtime is what interfaces need in ROS 2",
    "roscpp": _PORT,
    "tf": "tf2_ros is what ROS 2 has instead",
}
"""The packages of ROS 1 that students' code asks for, each with what to do in ROS 2."""


NOT_BUILT = "a package of interfaces that is neither installed here nor built with this one"
ONE_ZIP = "if it is yours, hand its interfaces in with the package, in it or beside it in one zip"


def absent(name: str) -> tuple[str, str]:
    """Return what to say of CMakeLists.txt asking for a package that is not here, and what to do."""
    remove = f"remove find_package({name} ...) from CMakeLists.txt and {name} from package.xml"
    if name in ROS_1:
        return f"it asks for `{name}`, which is part of ROS 1", ROS_1[name]
    if _CPP.fullmatch(name):
        return f"it asks for `{name}`, which is for C++; this kit is for Python only", remove
    if re.search(r"(_interfaces|_msgs|_msg|_srvs)$", name):
        return f"it asks for `{name}`, {NOT_BUILT}", f"{ONE_ZIP}; else {remove}"
    return f"it asks for `{name}`, which is not installed here", f"if the nodes do not use it, {remove}"
