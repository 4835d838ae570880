"""The environment that ROS 2 from wheels needs, and the real `ros2` command, which runs in place of ours."""

from __future__ import annotations

import contextlib
import os
import signal
import sys
from pathlib import Path

KEEP_OWN = "ROS2_COURSE_KIT_OWN"  # set to 1, ours runs although there is a real one


def complete() -> None:
    """Fill in missing variables: the wheels' own prefix, and libraries and modules of every sourced workspace."""
    found = _parts("AMENT_PREFIX_PATH")
    if sys.prefix not in found:
        found.append(sys.prefix)
    os.environ["AMENT_PREFIX_PATH"] = os.pathsep.join(found)
    os.environ.setdefault("ROS_DISTRO", "jazzy")
    os.environ.setdefault("ROS_VERSION", "2")
    os.environ.setdefault("ROS_PYTHON_VERSION", "3")
    overlays = [Path(part) for part in found if part != sys.prefix]
    site = f"lib/python{sys.version_info.major}.{sys.version_info.minor}/site-packages"
    _prepend("LD_LIBRARY_PATH", [one / "lib" for one in overlays])
    modules = [one / site for one in overlays]
    _prepend("PYTHONPATH", modules)
    sys.path[1:1] = [str(one) for one in modules if one.is_dir() and str(one) not in sys.path]


def libraries_loaded() -> bool:
    """Return whether this process was started with every workspace's libraries; the loader reads the path only once."""
    started = Path("/proc/self/environ")
    if not started.is_file():
        return True
    given = dict(entry.partition(b"=")[::2] for entry in started.read_bytes().split(b"\0"))
    had = given.get(b"LD_LIBRARY_PATH", b"").decode().split(os.pathsep)
    return all(part in had for part in _parts("LD_LIBRARY_PATH"))


def start_again() -> None:
    """Replace this process by a new start of itself, so that the loader sees the libraries added by `complete`.

    Ctrl-C is blocked meanwhile: while Python starts it would print a traceback.
    """
    signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
    os.execve(sys.executable, sys.orig_argv, dict(os.environ))


def _parts(name: str) -> list[str]:
    return [part for part in os.environ.get(name, "").split(os.pathsep) if part]


def _prepend(name: str, paths: list[Path]) -> None:
    there = _parts(name)
    new = [str(path) for path in paths if path.is_dir() and str(path) not in there]
    if new:
        os.environ[name] = os.pathsep.join([*new, *there])


# -- the real command -----------------------------------------------------------------------------------------------
def real_command() -> Path | None:
    """Return the path of the real command, or None.

    It is a program named ros2 on PATH that is not this one and whose text mentions ros2cli: a copy of ours in another
    virtual environment does not.
    """
    if os.environ.get(KEEP_OWN) == "1":
        return None
    mine = {Path(sys.argv[0]).resolve(), Path(sys.prefix).resolve() / "bin" / "ros2"}
    for folder in os.environ.get("PATH", "").split(os.pathsep):
        path = Path(folder or ".") / "ros2"
        if path.is_file() and os.access(path, os.X_OK) and path.resolve() not in mine:
            with contextlib.suppress(OSError):
                if b"ros2cli" in path.read_bytes()[:4096]:
                    return path
    return None


def step_aside(words: list[str]) -> None:
    """Replace this process by the real command, if there is one; else return."""
    if (path := real_command()) is not None:
        os.execv(path, [str(path), *words])
