"""Network namespaces for trusted commands, and the switch that turns the sandbox off."""

from __future__ import annotations

import os
from collections.abc import Sequence

UNSAFE_VARIABLE = "ROS2_COURSE_KIT_UNSAFE_NO_SANDBOX"
UNSAFE_NOTICE = (
    "Graded with --unsafe-no-sandbox: the submission's code saw this machine's processes and network, and other "
    "gradings. Its points can be trusted no more than the submission itself."
)


def private_network(command: Sequence[str]) -> list[str]:
    """Return the command line that runs a trusted `command` in a network namespace of its own, with loopback only.

    It keeps the host's /proc: over one mounted by bubblewrap, parts of which are read-only, the kernel would not let
    the sandboxes inside mount their own.
    """
    if sandbox_disabled():
        return list(command)
    outer = ["bwrap", "--dev-bind", "/", "/", "--tmpfs", "/dev/shm", "--unshare-net", "--unshare-ipc"]
    return [*outer, "--die-with-parent", "--", *command]


def sandbox_disabled() -> bool:
    """Return whether --unsafe-no-sandbox was given: no isolation of processes and networks."""
    return os.environ.get(UNSAFE_VARIABLE) == "1"
