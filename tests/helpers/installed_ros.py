"""A prefix such as /opt/ros/jazzy, laid out of the wheels' own files: no package index has one."""

from __future__ import annotations

import os
import sys
from importlib import metadata
from pathlib import Path

_NOT_OF_ROS = (".dist-info", "__pycache__", "ros_wheels_bootstrapper")  # what only wheels have


def lay_out(prefix: Path) -> Path:
    """Fill the folder `prefix` with everything that the wheels of ROS hold, and return it."""
    for distribution in metadata.distributions():
        if distribution.metadata["Name"].startswith("ros-"):
            for file in distribution.files or ():
                _place(Path(os.path.normpath(str(distribution.locate_file(file)))), prefix)
    return prefix


def _place(source: Path, prefix: Path) -> None:
    name = source.relative_to(sys.prefix)
    if not source.is_file() or any(part in str(name) for part in _NOT_OF_ROS):
        return
    if source.parent.name.endswith(".libs"):  # libraries of the distribution that ROS is installed on
        name = Path("lib", source.name)
    target = prefix / name
    target.parent.mkdir(parents=True, exist_ok=True)
    try:
        target.hardlink_to(source)
    except OSError:  # on another disk
        target.write_bytes(source.read_bytes())
        target.chmod(source.stat().st_mode)
