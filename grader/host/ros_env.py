"""Where the kit's ROS 2, of wheels, is on this machine, and the environment that a process needs to use it."""

from __future__ import annotations

import shutil
import sys
import sysconfig
from pathlib import Path

PREFIX = Path(sys.prefix)
# The interpreter below the virtual environment; a sandbox must mount both or Python cannot start in it.
BASE_PREFIX = Path(sys.base_prefix)
SITE_PACKAGES = Path(sysconfig.get_path("purelib"))
SITE_IN_PREFIX = SITE_PACKAGES.relative_to(PREFIX)
PREFIXES = (BASE_PREFIX, PREFIX)
"""The folders in which Python and the kit's packages are."""
CMAKE_HOOK = Path(__file__).parent / "wheel_prefix.cmake"
ON_THIS_MACHINE = {
    "ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET",
    "FASTRTPS_DEFAULT_PROFILES_FILE": str(Path(__file__).parent / "this_machine.xml"),
}
"""The variables with which nodes hear those of this machine alone; the file says why LOCALHOST will not do."""
_PATH = f"{PREFIX}/bin:/usr/local/bin:/usr/bin:/bin"
COMPILERS = {"C compiler": ("cc", "gcc", "clang"), "C++ compiler": ("c++", "g++", "clang++")}
"""Each with the names under which CMake looks for it."""
_TOOLS = COMPILERS | {tool: (tool,) for tool in ("colcon", "cmake", "ninja")}


def has_package(package: str) -> bool:
    """Return whether ROS has a package of this name."""
    return (PREFIX / "share" / package).exists()


def missing_tools(path: str = "") -> list[str]:
    """Return which of the programs that a build needs are not on the sandbox's PATH."""
    return [what for what, names in _TOOLS.items() if not any(shutil.which(name, path=path or _PATH) for name in names)]


def library_path(*overlays: Path) -> str:
    """Return LD_LIBRARY_PATH for ROS, with the libraries of each overlay's install tree first."""
    folders = [*(overlay / "lib" for overlay in overlays), PREFIX / "lib", *sorted(SITE_PACKAGES.glob("ros_*.libs"))]
    return ":".join(map(str, folders))


def environment(*overlays: Path, home: Path) -> dict[str, str]:
    """Return the whole environment for a process that uses ROS 2 with the given install trees on top.

    It starts empty, so neither the caller's ROS settings nor its secrets leak into it. _ROS_WHEELS_BOOTSTRAP_COMPLETE
    tells the wheels that the library path is already right, which saves them a second start of Python.
    """
    trees = ":".join(map(str, [*overlays, PREFIX]))
    return {
        "PATH": _PATH,
        "HOME": str(home),
        "LANG": "C.UTF-8",
        "PYTHONPATH": ":".join(str(path / SITE_IN_PREFIX) for path in overlays),
        "PYTHONDONTWRITEBYTECODE": "1",
        "PYTHONUNBUFFERED": "1",
        "LD_LIBRARY_PATH": library_path(*overlays),
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
