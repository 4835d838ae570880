"""The environment that ROS 2 from wheels needs: prefixes, libraries and modules of the workspaces that are sourced."""

from __future__ import annotations

import os
import signal
import sys
from pathlib import Path


def complete() -> None:
    """Fill in what is missing: the wheels' own prefix, and libraries and modules of every prefix before it."""
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
    """Say whether this process was started with every workspace's libraries; the loader reads the path only once."""
    started = Path("/proc/self/environ")
    if not started.is_file():
        return True
    given = dict(entry.partition(b"=")[::2] for entry in started.read_bytes().split(b"\0"))
    had = given.get(b"LD_LIBRARY_PATH", b"").decode().split(os.pathsep)
    return all(part in had for part in _parts("LD_LIBRARY_PATH"))


def start_again() -> None:
    """Replace this process by itself, so that the loader sees the libraries added by `complete`.

    Ctrl-C has to wait meanwhile: while Python starts it would be a traceback.
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
