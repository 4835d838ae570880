"""Find packages in the prefixes of AMENT_PREFIX_PATH, and say what to do about one that cannot be had."""

from __future__ import annotations

import os
from pathlib import Path

from .errors import PackageNotFoundError

# Packages that tutorials start and no Python index has, and what the course uses in their place.
ELSEWHERE = {
    "rviz2": "look at the robot with the kit's own views",
    "turtlesim": "use the kit's simulator",
    "gazebo_ros": "use the kit's simulator",
    "ros_gz_sim": "use the kit's simulator",
    "robot_state_publisher": "publish the poses from a node of your own",
    "joint_state_publisher": "publish the joint states from a node of your own",
    "tf2_ros": "publish the transforms from a node of your own",
    "slam_toolbox": "",
    "nav2_bringup": "",
    "nav2_common": "",
    "xacro": "",
    "demo_nodes_py": "write the talker and the listener as in the notebooks",
    "demo_nodes_cpp": "write the talker and the listener as in the notebooks",
    "rqt_graph": "use `ros2 node info`",
    "teleop_twist_keyboard": "use `ros2 topic pub /cmd_vel geometry_msgs/msg/Twist`",
}


def prefixes() -> list[Path]:
    """Return the prefixes in the order in which they are searched."""
    return [Path(part) for part in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep) if part]


def prefix(package: str) -> Path:
    """Return the prefix that holds the package."""
    for one in prefixes():
        if (one / "share/ament_index/resource_index/packages" / package).is_file():
            return one
    searched = [str(one) for one in prefixes()]
    advice = remark(package)
    raise PackageNotFoundError(f"\"package '{package}' not found, searching: {searched}\"{advice}")


def share(package: str) -> Path:
    """Return the package's share folder."""
    return prefix(package) / "share" / package


def remark(package: str) -> str:
    """Return what to add to the message that a package is not there."""
    if package in ELSEWHERE:
        instead = f"; {ELSEWHERE[package]}" if ELSEWHERE[package] else ""
        return f" - {package} cannot be installed with pip{instead}"
    if any((folder / "package.xml").is_file() for folder in (Path("src") / package, Path(package))):
        return (
            f" - build it and source its workspace: colcon build --packages-select {package}; source install/setup.bash"
        )
    return ""
