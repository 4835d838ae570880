"""The `ros2` commands, one module each, with the arguments and flags of the real ones; how each refuses."""

from __future__ import annotations

import ctypes
import os
import signal
from collections.abc import Callable, Iterable
from difflib import get_close_matches
from pathlib import Path

SETUP = Path(__file__).resolve().parents[1] / "setup.bash"
"""The file of the course kit that prepares a terminal; where this folder is installed by itself, it is missing."""
_SET_PDEATHSIG = 1  # of prctl(2)


class Refusal(Exception):
    """The request cannot be answered; the message goes to stderr."""


def near(name: str, names: Iterable[str]) -> str:
    """Return a line that suggests the nearest of the names, or "" if none is near or `name` is one of them."""
    names = list(names)
    found = [] if name in names else get_close_matches(name, names, 1, cutoff=0.7)
    if not found and len(begins := [one for one in names if one.startswith(name) and one != name]) == 1:
        found = begins
    return f"\nDid you mean {found[0]}?" if found else ""


def die_with_parent() -> Callable[[], None]:
    """Return the function that a child has to call before it becomes its command, to be killed when its parent dies."""
    parent = os.getpid()
    try:
        prctl = ctypes.CDLL(None).prctl
    except (OSError, AttributeError):  # not Linux
        return lambda: None

    def ask() -> None:
        prctl(_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() != parent:  # the parent died between fork and here
            os._exit(1)

    return ask
