"""Where ROS 2 is on this machine, and the environment that a process needs to use it.

That is the kit's own ROS, of wheels, unless one that is installed was chosen: then submissions are built and run with
that, and what observes them still with the kit's.
"""

from __future__ import annotations

import os
import re
import shutil
import sys
import sysconfig
from functools import cache
from pathlib import Path

from grader.errors import UsageError

PREFIX = Path(sys.prefix)
# The interpreter below the virtual environment; a sandbox must mount both or Python cannot start in it.
BASE_PREFIX = Path(sys.base_prefix)
SITE_PACKAGES = Path(sysconfig.get_path("purelib"))
SITE_IN_PREFIX = SITE_PACKAGES.relative_to(PREFIX)
VARIABLE = "ROS2_COURSE_KIT_ROS"
"""The prefix of the installed ROS 2 that was chosen, such as /opt/ros/jazzy."""
CMAKE_HOOK = Path(__file__).parent / "wheel_prefix.cmake"
_PATH = f"{PREFIX}/bin:/usr/local/bin:/usr/bin:/bin"
# Each with the names under which CMake looks for it.
_TOOLS = {
    "C compiler": ("cc", "gcc", "clang"), "C++ compiler": ("c++", "g++", "clang++"), "colcon": ("colcon",),
    "cmake": ("cmake",), "ninja": ("ninja",),
}  # fmt: skip
_RCLPY_OF_JAZZY = "7."
_VERSION = re.compile(r"<version>\s*([\w.]+)\s*</version>")


def installed() -> Path | None:
    """Return the prefix of the installed ROS 2 with which submissions are built and run, None for the kit's wheels."""
    return Path(os.environ[VARIABLE]) if os.environ.get(VARIABLE) else None


def inherited() -> dict[str, str]:
    """Return the environment variables by which a process of a grading knows which ROS was chosen."""
    return {VARIABLE: os.environ[VARIABLE]} if installed() else {}


def choose(prefix: Path) -> None:
    """Build and run submissions with the ROS 2 that is installed in `prefix`, in this process and those it starts.

    Raises:
        UsageError: it is not ROS 2 Jazzy, or for another Python than the kit's.
    """
    prefix = prefix.resolve()
    if not (prefix / SITE_IN_PREFIX / "rclpy").is_dir():
        others = sorted(path.parts[-3] for path in prefix.glob("lib/python3*/site-packages/rclpy"))
        raise UsageError(
            f"{prefix} has no rclpy for this Python ({SITE_IN_PREFIX}/rclpy).",
            f"Set the kit up with its own: rm -rf .venv && make setup PYTHON={others[0]}."
            if others
            else "Name the folder that has ROS's setup.bash, such as /opt/ros/jazzy.",
        )
    version = _versions(prefix).get("rclpy", "none")
    if not version.startswith(_RCLPY_OF_JAZZY):
        raise UsageError(f"{prefix} has rclpy {version}, which is not of ROS 2 Jazzy.", "Choose one that is.")
    os.environ[VARIABLE] = str(prefix)


def sourced() -> Path | None:
    """Return the prefix of an installed ROS 2 for this Python whose setup file was sourced here, None without one."""
    paths = map(Path, filter(None, os.environ.get("AMENT_PREFIX_PATH", "").split(":")))
    return next((path for path in paths if path != PREFIX and (path / SITE_IN_PREFIX / "rclpy").is_dir()), None)


def name() -> str:
    """Return in words which ROS builds and runs submissions."""
    prefix = installed()
    return f"{prefix}, rclpy {_versions(prefix).get('rclpy', '?')}" if prefix else "the kit's wheels"


def identity() -> str:
    """Return all that decides what the installed ROS does: its place and its packages' versions; "" for the wheels."""
    prefix = installed()
    return f"{prefix} {sorted(_versions(prefix).items())}" if prefix else ""


@cache
def _versions(prefix: Path) -> dict[str, str]:
    """Return the versions of the packages that an installed ROS has, by their names."""
    texts = {path.parent.name: path.read_text(errors="replace") for path in prefix.glob("share/*/package.xml")}
    return {package: found[1] for package, text in texts.items() if (found := _VERSION.search(text))}


def prefixes() -> list[Path]:
    """Return the folders in which Python, the kit's packages and an installed ROS are."""
    return [BASE_PREFIX, PREFIX, *filter(None, [installed()])]


def has_package(package: str) -> bool:
    """Return whether ROS has a package of this name."""
    return any((share / package).exists() for share in share_folders())


def share_folders() -> list[Path]:
    """Return the folders in which ROS's packages have theirs."""
    return [prefix / "share" for prefix in (PREFIX, installed()) if prefix]


def missing_tools(path: str = "") -> list[str]:
    """Return which of the programs that a build needs are not on the sandbox's PATH."""
    return [what for what, names in _TOOLS.items() if not any(shutil.which(name, path=path or _PATH) for name in names)]


def library_path(*overlays: Path, wheels: bool = False) -> str:
    """Return LD_LIBRARY_PATH for ROS, with the libraries of each overlay's install tree first."""
    prefix = None if wheels else installed()
    own = [PREFIX / "lib", *sorted(SITE_PACKAGES.glob("ros_*.libs"))]
    ros = (
        [prefix / "lib", *sorted(prefix.glob("opt/*/lib")), *sorted(prefix.glob("lib/*-linux-gnu"))] if prefix else own
    )
    return ":".join(str(path) for path in [*(overlay / "lib" for overlay in overlays), *ros])


def environment(*overlays: Path, home: Path, wheels: bool = False) -> dict[str, str]:
    """Return the whole environment for a process that uses ROS 2 with the given install trees on top.

    It starts empty, so neither the caller's ROS settings nor its secrets leak into it. _ROS_WHEELS_BOOTSTRAP_COMPLETE
    tells the wheels that the library path is already right, which saves them a second start of Python. `wheels` is for
    what is the kit's own: it uses the wheels whatever ROS is installed.
    """
    prefix = None if wheels else installed()
    modules = [path / SITE_IN_PREFIX for path in (*overlays, *filter(None, [prefix]))]
    trees = ":".join(map(str, [*overlays, prefix or PREFIX]))
    return {
        "PATH": f"{prefix}/bin:{_PATH}" if prefix else _PATH,
        "HOME": str(home),
        "LANG": "C.UTF-8",
        "PYTHONPATH": ":".join(map(str, modules)),
        "PYTHONDONTWRITEBYTECODE": "1",
        "PYTHONUNBUFFERED": "1",
        "LD_LIBRARY_PATH": library_path(*overlays, wheels=wheels),
        "_ROS_WHEELS_BOOTSTRAP_COMPLETE": "1",
        "AMENT_PREFIX_PATH": trees,
        "CMAKE_PREFIX_PATH": trees,
        "ROS_DISTRO": "jazzy",
        "ROS_VERSION": "2",
        "ROS_PYTHON_VERSION": "3",
        "ROS_LOG_DIR": str(home / "ros-log"),
        "RMW_IMPLEMENTATION": "rmw_fastrtps_cpp",
        # Sandboxes share the trial's network but not its /dev/shm: over shared memory no message would arrive.
        "FASTDDS_BUILTIN_TRANSPORTS": "UDPv4",
        # numpy's own threads would only compete with the simulator for the two cores.
        "OPENBLAS_NUM_THREADS": "1",
    }
