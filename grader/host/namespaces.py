"""Network namespaces for trusted commands and processes, and the switch that turns the sandbox off."""

from __future__ import annotations

import ctypes
import fcntl
import os
import socket
import struct
from collections.abc import Sequence
from pathlib import Path

UNSAFE_VARIABLE = "ROS2_COURSE_KIT_UNSAFE_NO_SANDBOX"
UNSAFE_NOTICE = (
    "Graded with --unsafe-no-sandbox: the submission's code saw this machine's processes and network, and other "
    "gradings. Its points can be trusted no more than the submission itself."
)
# <linux/sched.h>, <linux/sockios.h>, <linux/if.h>, <linux/capability.h>
_NEW_USER, _NEW_NETWORK = 0x10000000, 0x40000000
_SET_INTERFACE_FLAGS = 0x8914
_UP_AND_RUNNING = 0x41
_CAPABILITIES_3 = 0x20080522

_libc = ctypes.CDLL(None, use_errno=True)


def private_network(command: Sequence[str]) -> list[str]:
    """Return the command line that runs a trusted `command` in a network namespace of its own, with loopback only.

    It keeps the host's /proc: over one mounted by bubblewrap, parts of which are read-only, the kernel would not let
    the sandboxes inside mount their own.
    """
    if sandbox_disabled():
        return list(command)
    outer = ["bwrap", "--dev-bind", "/", "/", "--tmpfs", "/dev/shm", "--unshare-net", "--unshare-ipc"]
    return [*outer, "--die-with-parent", "--", *command]


def enter_private_network() -> None:
    """Move this process, which has one thread, into a network namespace of its own, with loopback only.

    Raises:
        OSError: the kernel does not allow it, for instance because only bubblewrap may make user namespaces.
    """
    if sandbox_disabled():
        return
    made_user_namespace = False
    user, group = os.geteuid(), os.getegid()
    try:
        _call("unshare", _NEW_NETWORK)
    except PermissionError:
        _call("unshare", _NEW_USER | _NEW_NETWORK)
        made_user_namespace = True
        own = Path("/proc/self")
        own.joinpath("setgroups").write_text("deny")
        own.joinpath("uid_map").write_text(f"{user} {user} 1")
        own.joinpath("gid_map").write_text(f"{group} {group} 1")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as any_socket:
        fcntl.ioctl(any_socket, _SET_INTERFACE_FLAGS, struct.pack("16sH14x", b"lo", _UP_AND_RUNNING))
    if made_user_namespace:  # in which it has every capability
        _call("capset", struct.pack("=Ii", _CAPABILITIES_3, 0), bytes(24))


def sandbox_disabled() -> bool:
    """Return whether --unsafe-no-sandbox was given: no isolation of processes and networks."""
    return os.environ.get(UNSAFE_VARIABLE) == "1"


def _call(name: str, *arguments: int | bytes) -> None:
    if getattr(_libc, name)(*arguments) != 0:
        raise OSError(ctypes.get_errno(), f"{name}: {os.strerror(ctypes.get_errno())}")
