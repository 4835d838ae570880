"""Find the real `ros2` command on this machine. Where there is one, ours steps aside."""

from __future__ import annotations

import importlib.util
import os
import sys
from pathlib import Path

VARIABLE = "ROS2_COURSE_KIT_OWN"  # set to 1, ours answers although there is a real one


def real_command() -> Path | None:
    """Return the real command, or nothing.

    It is a program named ros2 on PATH that is not this one, and whose text speaks of ros2cli: another virtual
    environment's copy of ours does not.
    """
    if os.environ.get(VARIABLE) == "1":
        return None
    mine = {Path(sys.argv[0]).resolve(), Path(sys.prefix).resolve() / "bin" / "ros2"}
    for folder in os.environ.get("PATH", "").split(os.pathsep):
        path = Path(folder or ".") / "ros2"
        if path.is_file() and os.access(path, os.X_OK) and path.resolve() not in mine and _is_real(path):
            return path
    return None


def _is_real(path: Path) -> bool:
    try:
        return b"ros2cli" in path.read_bytes()[:4096]
    except OSError:
        return False


def real_module() -> bool:
    """Say whether the real command can be imported, though no program of its name is on PATH."""
    if os.environ.get(VARIABLE) == "1":
        return False
    try:
        return importlib.util.find_spec("ros2cli.cli") is not None
    except ImportError:
        return False


def step_aside(words: list[str]) -> None:
    """Become the real command, if there is one; else return."""
    if (path := real_command()) is not None:
        os.execv(path, [str(path), *words])
    if real_module():
        start = "import sys; from ros2cli.cli import main; sys.argv[0] = 'ros2'; sys.exit(main())"
        os.execv(sys.executable, [sys.executable, "-c", start, *words])
