"""What the first process of a sandbox does that forks others: import what they need, and clear away what they leave.

It is mounted beside a script that uses it (below a folder `grader/sandbox`), and imports nothing of the kit.
"""

from __future__ import annotations

import contextlib
import ctypes
import faulthandler
import gc
import importlib
import os
import shutil
import signal
import sys
from pathlib import Path

# What nodes, and tests of nodes, import. No module that draws numbers at random when it is imported, as numpy.random
# does: all forks would draw the same.
MODULES = (
    "numpy", "yaml",
    "rclpy", "rclpy.action", "rclpy.callback_groups", "rclpy.duration", "rclpy.executors", "rclpy.logging",
    "rclpy.node", "rclpy.parameter", "rclpy.qos", "rclpy.time",
    "action_msgs.msg", "geometry_msgs.msg", "nav_msgs.msg", "rcl_interfaces.msg", "rcl_interfaces.srv",
    "rosgraph_msgs.msg", "sensor_msgs.msg", "std_msgs.msg", "std_srvs.srv", "unittest.mock",
    # What these import.
    "ament_index_python", "builtin_interfaces", "rosidl_parser", "rpyutils", "type_description_interfaces",
    "unique_identifier_msgs",
)  # fmt: skip
_SET_DUMPABLE = 4  # <linux/prctl.h>


def forget_the_kit() -> None:
    """Take the script's folder, and what it has imported from there, out of what a fork could import or find."""
    sys.path[:] = sys.path[1:]
    for name in [name for name in sys.modules if name.partition(".")[0] == "grader"]:
        del sys.modules[name]


def import_ros() -> None:
    """Import the modules and load the C code of the usual messages, as far as they are there."""
    for name in MODULES:
        with contextlib.suppress(ImportError):
            importlib.import_module(name)


def freeze() -> None:
    """Keep the garbage collector off what is there by now: a fork that never touches these pages never copies them."""
    gc.collect()
    gc.freeze()


def shield() -> None:
    """Keep forks from reading this process's memory and descriptors, and from stopping it.

    The kernel keeps signals for which there is no handler from the first process of a pid namespace. See prctl(2).
    """
    if os.getpid() == 1:  # proot, below which a sandbox without namespaces is, has to read its memory
        ctypes.CDLL(None).prctl(_SET_DUMPABLE, 0, 0, 0, 0)
    faulthandler.disable()
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def unshield() -> None:
    """Undo this in a fork."""
    ctypes.CDLL(None).prctl(_SET_DUMPABLE, 1, 0, 0, 0)
    signal.signal(signal.SIGINT, signal.default_int_handler)
    if "PYTHONFAULTHANDLER" in os.environ:
        faulthandler.enable()


def kill_others() -> None:
    """Kill all that the forks have started, and wait: this process is the parent of all that have lost theirs."""
    if os.getpid() == 1:
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.kill(-1, signal.SIGKILL)  # everything but this process
    with contextlib.suppress(ChildProcessError):
        while True:
            if os.getpid() != 1:  # a sandbox without a pid namespace
                for child in Path(f"/proc/self/task/{os.getpid()}/children").read_text().split():
                    os.kill(int(child), signal.SIGKILL)
            os.waitpid(-1, 0)


def empty(folder: Path) -> None:
    """Delete everything below `folder`, except a Python installation."""
    with contextlib.suppress(OSError):
        for path in folder.iterdir():
            if any(Path(prefix).is_relative_to(path) for prefix in (sys.prefix, sys.base_prefix)):
                # It is mounted read-only; but trying to delete its 800 MB takes seconds, at every run.
                continue
            remove(path)


def empty_own_folders() -> None:
    """Delete what was written to the sandbox's disks in memory."""
    for folder in (Path("/tmp"), Path(os.environ["HOME"]), Path("/dev/shm")):
        empty(folder)


def remove(path: Path) -> None:
    """Delete a file, a link, or a folder with all that is in it."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path, ignore_errors=True)
    else:
        path.unlink(missing_ok=True)
