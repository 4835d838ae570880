"""Choose the DDS domain of a workspace, so that no two workspaces of one machine hear each other.

DDS keeps domains apart within one network. So do abstract Unix sockets: a process claims a domain by a socket whose
name has the domain's number, everyone in the network namespace can read these names, and a claim ends with its process.
"""

from __future__ import annotations

import hashlib
import os
import socket
from pathlib import Path

from grader.errors import GraderError
from grader.host.atomic import write_atomically
from grader.words import say

DOMAINS = range(1, 101)
"""Those whose ports are below the ones that Linux gives to programs that ask for any (101 would be the last)."""
_FILE = ".ros_domain"
_SOCKETS = Path("/proc/net/unix")
_PREFIX = "ros2-course-kit/domain"
_claims: dict[Path, socket.socket] = {}


def of(root: Path) -> int:
    """Return the domain of the workspace `root`: the one that was claimed last, else the one that its path suggests."""
    try:
        number = int((root / _FILE).read_text())
    except (OSError, ValueError):
        number = 0
    return number if number in DOMAINS else _suggested(root)


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
        held = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        held.bind(f"\0{_PREFIX}/{number}/{_identity(root)}/{os.getpid()}")
        # Looked at after it was bound: of two who claim it at the same moment at least one sees the other.
        if _users(number) <= {_identity(root)}:
            _claims[root] = held
            write_atomically(root / _FILE, f"{number}\n")
            return number
        held.close()
    raise GraderError(
        say(
            "All {n} ROS domains of this machine are in use, so two robots would share one. "
            "Shut down the kernels of notebooks that are not in use, then run this cell again.",
            n=len(DOMAINS),
        )
    )


def _users(number: int) -> set[str]:
    """Return the workspaces that have claimed a domain."""
    start = f"@{_PREFIX}/{number}/"
    names = (line.rpartition(" ")[2] for line in _SOCKETS.read_text(errors="replace").splitlines())
    return {name.removeprefix(start).partition("/")[0] for name in names if name.startswith(start)}


def _identity(root: Path) -> str:
    """Return what tells a workspace from others on this machine, even if containers give them the same path."""
    status = root.stat()
    return hashlib.sha256(f"{root}\0{status.st_dev}\0{status.st_ino}\0{status.st_uid}".encode()).hexdigest()[:16]


def _suggested(root: Path) -> int:
    digest = hashlib.sha256(os.fsencode(root)).digest()
    return DOMAINS[int.from_bytes(digest[:4], "big") % len(DOMAINS)]
