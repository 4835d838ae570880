"""The versions and hashes that decide a grade, recorded so that an appeal can repeat the grading."""

from __future__ import annotations

import hashlib
import os
import platform
from importlib import metadata

from grader import KIT

_DISTRIBUTIONS = ("ros2-course-kit", "ros-jazzy-rclpy", "pymunk", "numpy", "pytest", "coverage")


def environment() -> dict[str, str]:
    """Return the versions of the software that graded, by name, with the system and its number of cores."""
    versions = {name: _version(name) for name in _DISTRIBUTIONS}
    return versions | {"python": platform.python_version(), "system": platform.platform(), "cores": str(os.cpu_count())}


def kit_hash() -> str:
    """Return a hash of the kit's own code, 16 hexadecimal digits."""
    digest = hashlib.sha256()
    for path in sorted(path for folder in (KIT / "grader", KIT / "sim") for path in folder.rglob("*.py")):
        digest.update(f"{path.relative_to(KIT)}\0".encode() + path.read_bytes())
    return digest.hexdigest()[:16]


def _version(name: str) -> str:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return "not installed"
