"""Packages by the prefixes in AMENT_PREFIX_PATH: executables, interfaces, and advice about one that is missing."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

from ament_index_python import get_resources, get_search_paths

from . import SETUP, Refusal, near

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
# Written when a package is installed; a build that fails before leaves other files in its prefix.
_MARKER = Path("share/ament_index/resource_index/packages")
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


def require(package: str) -> Path:
    """Return the prefix that holds a package, which a command line names."""
    if (found := prefix(package)) is None:
        raise Refusal(f"Package '{package}' not found{advice(package)}")
    return found


def executables(package: str) -> list[Path]:
    """Return the executables of a package."""
    folder = require(package) / "lib" / package
    return sorted(path for path in folder.rglob("*") if path.is_file() and os.access(path, os.X_OK))


def advice(package: str) -> str:
    """Return a line about what to do if a package is not found, or "" if nothing is known about it."""
    if package in ELSEWHERE:
        instead = f"; {ELSEWHERE[package]}" if ELSEWHERE[package] else ""
        return f"\n{package} cannot be installed with pip{instead}"
    for workspace in _workspaces():
        install = workspace / "install"  # built with --merge-install, all packages share one prefix
        if any((prefix / _MARKER / package).is_file() for prefix in (install / package, install)):
            return f"\nIt is built in {workspace}, but not sourced in this terminal: {_lines(workspace, build=False)}"
        if (workspace / "src" / package / "package.xml").is_file():
            return f"\nIt is not built yet; its source is in {workspace / 'src'}: {_lines(workspace, build=True)}"
    return near(package, names())


def _workspaces() -> Iterator[Path]:
    """Yield the folders that may be the workspace: this one and those above it, each before the `ws` in it."""
    here = Path.cwd()
    for folder in (here, *here.parents):
        yield folder
        yield folder / "ws"


def _lines(workspace: Path, *, build: bool) -> str:
    """Return what to type to use a workspace; a terminal that is not prepared for the wheels cannot build there."""
    shell = "zsh" if Path(os.environ.get("SHELL", "")).name == "zsh" else "bash"
    steps = [f"source {workspace}/install/setup.{shell}"]
    if build:
        steps = [f"cd {workspace}", "colcon build", f"source install/setup.{shell}"]
    if SETUP.is_file() and not {"CMAKE_TOOLCHAIN_FILE", "COLCON_DEFAULTS_FILE"} & os.environ.keys():
        steps.insert(0, f"source {SETUP}")
    return " && ".join(steps)


def interfaces_of(package: str) -> list[str]:
    """Return the interfaces of a package as `kind/Name`, in the order of its list."""
    found = get_resources("rosidl_interfaces").get(package)
    if found is None:
        raise Refusal(f"Unknown package '{package}'")
    listed = Path(found) / "share/ament_index/resource_index/rosidl_interfaces" / package
    files = [line.strip() for line in listed.read_text().splitlines()]
    return [name for name, ending in (line.rsplit(".", 1) for line in files if "." in line) if ending in KINDS]


def interfaces() -> list[str]:
    """Return all interfaces, as `package/kind/Name`."""
    return sorted(f"{package}/{name}" for package in names("rosidl_interfaces") for name in interfaces_of(package))


def definition(package: str, kind: str, name: str) -> Path:
    """Return the file that defines an interface."""
    found = prefix(package)
    if found is None:
        raise Refusal(f"Unknown package '{package}'{near(package, names('rosidl_interfaces'))}")
    path = found / "share" / package / kind / f"{name}.{kind}"
    if not path.is_file():
        raise Refusal(f"Could not find the interface '{path}'{near(f'{package}/{kind}/{name}', interfaces())}")
    return path
