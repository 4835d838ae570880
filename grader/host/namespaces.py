"""Network namespaces for trusted commands, and the switch that does without a sandbox."""

from __future__ import annotations

import os
from collections.abc import Sequence

UNSAFE_VARIABLE = "ROS2_COURSE_KIT_UNSAFE_NO_SANDBOX"


UNSAFE_WORDS = (
    "Graded with --unsafe-no-sandbox: the submission's code saw this machine's processes and network, and other "
    "gradings. Its points can be trusted no more than the submission itself."
)


def private_network(command: Sequence[str]) -> list[str]:
    """Return the command line that runs a trusted `command` in a network namespace of its own, with loopback only.

    The host's /proc stays in sight: over a /proc of bubblewrap's making (parts of it are read-only) the kernel refuses
    the walls inside one of their own.
    """
    if unsafe():
        return list(command)
    outer = ["bwrap", "--dev-bind", "/", "/", "--tmpfs", "/dev/shm", "--unshare-net", "--unshare-ipc"]
    return [*outer, "--die-with-parent", "--", *command]


def unsafe() -> bool:
    """Return whether somebody has asked for gradings without walls between processes and networks."""
    return os.environ.get(UNSAFE_VARIABLE) == "1"
