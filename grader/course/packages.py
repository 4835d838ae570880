"""What a submission can import, what to say of what is not here, and which key in package.xml declares a package."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib import metadata
from typing import Any

from packaging.utils import canonicalize_name

from grader import KIT
from grader.course.model import Course
from grader.words import say

_MORE_OF_ROS = ("rcl_interfaces", "ament_index_python", "launch", "launch_ros")


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
# Names in code whose rosdep keys are more than "python3-" and the name.
_ALSO = {
    "yaml": ("pyyaml",),
    "cv2": ("opencv", "libopencv-dev", "cv-bridge", "vision-opencv"),
    "PIL": ("pil", "pillow"),
    "serial": ("pyserial",),
    "sklearn": ("sklearn", "scikit-learn"),
    "skimage": ("skimage", "scikit-image"),
    "usb": ("usb", "pyusb"),
    "pkg_resources": ("pkg-resources", "setuptools"),
    # A package's linter tests may also be declared by the two packages that bring all linters.
    "ament_copyright": ("ament-lint-common", "ament-lint-auto", "ament-cmake-copyright"),
    "ament_flake8": ("ament-lint-common", "ament-lint-auto", "ament-cmake-flake8"),
    "ament_pep257": ("ament-lint-common", "ament-lint-auto", "ament-cmake-pep257"),
    "pytest": ("ament-cmake-pytest",),
    # ROS's tutorial on launch files declares the command, which depends on both.
    "launch": ("ros2launch",),
    "launch_ros": ("ros2launch",),
}


@dataclass(frozen=True)
class Package:
    """A package as pip knows it, and the version that is offered."""

    name: str
    version: str

    @property
    def modules(self) -> tuple[str, ...]:
        """Return the modules that Python imports of it; if it is not installed, what its name suggests."""
        name, distributions = canonicalize_name(self.name), _distributions()
        found = sorted(module for module in distributions if name in distributions[module] and module[0].isalpha())
        alike = name.replace("-", "_")
        return (alike,) if alike in found or not found else tuple(found)


def offered() -> list[Package]:
    """Return the packages of Python that a submission can import, sorted."""
    kits = {canonicalize_name(name) for name in (*_project()["dependencies"], "pytest")}
    pins: dict[str, list[str]] = {}
    for name, version in re.findall(
        r"(?m)^([\w.-]+)==([^\s;]+)", (KIT / "requirements.txt").read_text(encoding="utf-8")
    ):
        if canonicalize_name(name) in kits:
            pins.setdefault(name, []).append(version)  # one for each of several versions of Python
    found = {name: Package(name, say(" or ").join(versions)) for name, versions in pins.items()}
    return sorted(found.values(), key=lambda each: each.name)


def of_ros(course: Course) -> list[str]:
    """Return the packages of ROS that a course's nodes and launch files may import."""
    without = {
        *(() if course.launch else ("launch", "launch_ros")),
        *(() if any(node.actions for node in course.nodes.values()) else ("action_msgs",)),
    }
    names = re.findall(r"ros-jazzy-([\w-]+)", " ".join(_project()["optional-dependencies"]["ros"]))
    return [name for name in (*(name.replace("-", "_") for name in names), *_MORE_OF_ROS) if name not in without]


def names() -> str:
    """Return in words what a submission can import of Python's packages, as Python names it."""
    return ", ".join(module for package in offered() for module in package.modules)


@cache
def _distributions() -> dict[str, list[str]]:
    """Return the packages that each module is in."""
    return {module: list(map(canonicalize_name, names)) for module, names in metadata.packages_distributions().items()}


@cache
def _project() -> dict[str, Any]:
    found: dict[str, Any] = tomllib.loads((KIT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    return found


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


def is_declared(name: str, declared: Sequence[str]) -> bool:
    """Return whether one of the `declared` keys declares the package or module `name`: python3-numpy does numpy."""
    wanted = {_key(name), *_ALSO.get(name, ())}
    return bool(wanted & {_key(other) for other in declared})


def _key(name: str) -> str:
    return re.sub(r"^python3?-|-pip$", "", name.lower().replace("_", "-"))
