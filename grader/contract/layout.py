"""The contract's layout of the package, and what a file in it is for."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import PurePosixPath

from grader.contract.spec import CONVERSIONS_MODULE, LAUNCH_FILES, NODE_MODULES, NODE_TESTS, PACKAGE

LAYOUT = (
    "CMakeLists.txt",
    "package.xml",
    "setup.py",
    "setup.cfg",
    f"{PACKAGE}/__init__.py",
    *NODE_MODULES,
    f"{PACKAGE}/utils/__init__.py",
    CONVERSIONS_MODULE,
    "msg/SensorFusionData.msg",
    "srv/SetSpeed.srv",
    "srv/GetRobotStatus.srv",
    "action/NavigateToPosition.action",
    *LAUNCH_FILES,
    "config/robot_params.yaml",
    "config/sensor_params.yaml",
    "scripts/demo.py",
    *NODE_TESTS,
    "test_results.xml",
    "README.md",
)


def layout_of(paths: Collection[str], package: str) -> list[str]:
    """Return the layout of the package with these paths; its modules may be in a folder named like `package`."""
    names = (PACKAGE, package)
    folder = next((name for name in names if any(path.startswith(f"{name}/") for path in paths)), PACKAGE)
    return [path.replace(f"{PACKAGE}/", f"{folder}/") for path in LAYOUT]


JUDGED = ("module", "launch", "script")
"""The roles of files that run on the robot; tests and setup.py serve the author."""


def role(path: str) -> str:
    """Return what a file is for: "module", "launch", "script", "test" or "setup".

    The nodes can import every file of the Python package, so none of them is a test or a launch file by its name.
    """
    parts = PurePosixPath(path).parts
    name = parts[-1]
    if parts[0] == PACKAGE and len(parts) > 1:
        return "module"
    if parts[0] in ("test", "tests") or (len(parts) == 1 and _is_collected(name)):
        return "test"
    if parts == ("setup.py",):
        return "setup"
    if parts[0] == "launch" or name.endswith((".launch.py", "_launch.py")):
        return "launch"
    # Python without `.py` was recognised by its first line, which makes it a program.
    in_scripts = parts[0] in ("scripts", "bin", "examples", "tools", "demo")
    return "script" if in_scripts or not name.endswith(".py") else "module"


def _is_collected(name: str) -> bool:
    """Return whether pytest collects a file of this name."""
    return name == "conftest.py" or (name.startswith("test_") and name.endswith(".py")) or name.endswith("_test.py")
