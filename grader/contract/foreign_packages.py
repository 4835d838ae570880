"""What to say of a package that a submission asks for and that is not here."""

from __future__ import annotations

import re

_CPP = re.compile(r"rclcpp\w*|\w+_cpp|ament_cmake_auto|pluginlib|class_loader|Eigen3|PCL|pcl_\w+|OpenCV|tf2_eigen")


def absent(name: str) -> tuple[str, str]:
    """Return what to say of CMakeLists.txt asking for a package that is not here, and what to do."""
    remove = f"remove find_package({name} ...) from CMakeLists.txt and {name} from package.xml"
    if _CPP.fullmatch(name):
        return f"it asks for `{name}`, which is for C++; this kit is for Python only", remove
    if re.search(r"(_interfaces|_msgs|_msg|_srvs)$", name):
        text = f"it asks for `{name}`, a package of interfaces that is neither installed here nor in the submission"
        return text, f"if it is yours, hand it in with the package (both folders in one zip); else {remove}"
    return f"it asks for `{name}`, which is not installed here", f"if the nodes do not use it, {remove}"
