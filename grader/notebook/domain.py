"""Choose the DDS domain of a workspace, so that no two workspaces of one machine hear each other."""

from __future__ import annotations

import hashlib
import os
import socket
from pathlib import Path

from grader.errors import GraderError
from grader.host import dds_domain
from grader.host.tempdir import write_atomically
from grader.words import say

DOMAINS = dds_domain.LOW
_FILE = ".ros_domain"
_claims: dict[Path, socket.socket] = {}


def of(root: Path) -> int:
    """Return the domain of the workspace `root`: the one that was claimed last, else the one that its path suggests."""
    try:
        number = int((root / _FILE).read_text())
    except (OSError, ValueError):
        number = 0
    digest = hashlib.sha256(os.fsencode(root)).digest()
    return number if number in DOMAINS else DOMAINS[int.from_bytes(digest[:4], "big") % len(DOMAINS)]


def claim(root: Path) -> int:
    """Claim a domain for the workspace `root` until this process ends, and return it.

    It stays the same for as long as no other workspace has claimed it meanwhile. Several processes may work in one
    workspace: they share its domain.

    Raises:
        GraderError: other workspaces use all domains.
    """
    if root in _claims:
        return of(root)
    first = of(root)
    others = [number for number in DOMAINS if number != first]
    for number in [first, *others]:
        if held := dds_domain.claim(number, _identity(root)):
            _claims[root] = held
            write_atomically(root / _FILE, f"{number}\n")
            return number
    raise GraderError(
        say(
            "All {n} ROS domains of this machine are in use, so two robots would share one. "
            "Shut down the kernels of notebooks that are not in use, then run this cell again.",
            n=len(DOMAINS),
        )
    )


def _identity(root: Path) -> str:
    """Return what tells a workspace from others on this machine, even if containers give them the same path."""
    status = root.stat()
    return hashlib.sha256(f"{root}\0{status.st_dev}\0{status.st_ino}\0{status.st_uid}".encode()).hexdigest()[:16]
