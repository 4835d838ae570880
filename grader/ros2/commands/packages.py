"""Packages by the prefixes in AMENT_PREFIX_PATH: executables, interfaces, and advice about one that is missing."""

from __future__ import annotations

import os
from pathlib import Path

from ament_index_python import get_resources, get_search_paths

from .refusals import Refusal, near

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
KINDS = {"msg": "Messages", "srv": "Services", "action": "Actions"}


def prefixes() -> list[Path]:
    """Return the prefixes in the order in which they are searched."""
    return [Path(path) for path in get_search_paths()]


def names(kind: str = "packages") -> list[str]:
    """Return the sorted names of all resources of a kind."""
    return sorted(get_resources(kind))


def prefix(package: str) -> Path | None:
    """Return the prefix that holds a package, or None."""
    found = get_resources("packages").get(package)
    return None if found is None else Path(found)


def executables(package: str) -> list[Path] | None:
    """Return the executables of a package, or None if there is no such package."""
    found = prefix(package)
    if found is None:
        return None
    folder = found / "lib" / package
    return sorted(path for path in folder.rglob("*") if path.is_file() and os.access(path, os.X_OK))


def advice(package: str) -> str:
    """Return a line about what to do if a package is not found, or "" if nothing is known about it."""
    if package in ELSEWHERE:
        instead = f"; {ELSEWHERE[package]}" if ELSEWHERE[package] else ""
        return f"\n{package} cannot be installed with pip{instead}"
    here = Path.cwd()
    for folder in (here, *here.parents):
        install = folder / "install"
        if (install / package / "share" / package).is_dir() or (install / "share" / package).is_dir():
            return f"\nIt is built in {install}, which is not sourced here: source {install}/setup.bash"
        if (folder / "src" / package / "package.xml").is_file():
            return f"\nIts source is in {folder}/src: cd {folder} && colcon build && source install/setup.bash"
    return near(package, names())


def interfaces_of(package: str) -> list[str]:
    """Return the interfaces of a package as `kind/Name`, in the order of its list."""
    found = get_resources("rosidl_interfaces").get(package)
    if found is None:
        raise Refusal(f"Unknown package '{package}'")
    listed = Path(found) / "share/ament_index/resource_index/rosidl_interfaces" / package
    files = [line.strip() for line in listed.read_text().splitlines()]
    return [name for name, ending in (line.rsplit(".", 1) for line in files if "." in line) if ending in KINDS]


def interfaces(*kinds: str) -> list[str]:
    """Return all interfaces of the kinds, by default of all kinds, as `package/kind/Name`."""
    found = (f"{package}/{name}" for package in names("rosidl_interfaces") for name in interfaces_of(package))
    return sorted(name for name in found if not kinds or name.split("/")[1] in kinds)


def definition(package: str, kind: str, name: str) -> Path:
    """Return the file that defines an interface."""
    found = prefix(package)
    if found is None:
        raise Refusal(f"Unknown package '{package}'{near(package, names('rosidl_interfaces'))}")
    path = found / "share" / package / kind / f"{name}.{kind}"
    if not path.is_file():
        raise Refusal(f"Could not find the interface '{path}'{near(f'{package}/{kind}/{name}', interfaces())}")
    return path
