"""Claim DDS domains, so that no two workspaces, trials or test runs of one network hear each other.

DDS keeps domains apart within one network. So do abstract Unix sockets: a process claims a domain by a socket whose
name has the domain's number, everyone in the network namespace can read these names, and a claim ends with its process.
"""

from __future__ import annotations

import contextlib
import os
import random
import secrets
import socket
import time
from collections.abc import Iterator
from pathlib import Path

from grader.errors import GraderError
from grader.host import namespaces
from grader.words import mark, say

LOW = range(1, 101)
"""Those whose ports are below the ones that Linux gives to programs that ask for any (101 would be the last)."""
HIGH = range(215, 233)
"""Those above, which no notebook takes."""
EACH = 10
"""The most that one grading holds at a time: six trials, and four processes for the package's own tests."""
_SOCKETS = Path("/proc/net/unix")
_PREFIX = "ros2-course-kit/domain"
_LOOK_S, _WAIT_S = 0.2, 900.0  # as long as the longest trial


def claim(number: int, identity: str) -> socket.socket | None:
    """Return a claim on a domain, which ends when it is closed; None if others than `identity` have one."""
    held = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
    held.bind(f"\0{_PREFIX}/{number}/{identity}/{os.getpid()}")
    # Looked at after it was bound: of two who claim it at the same moment at least one sees the other.
    if _users(number) <= {identity}:
        return held
    held.close()
    return None


@contextlib.contextmanager
def free(*, after: int = 0) -> Iterator[int]:
    """Hold a domain that nobody else has, rather another one than `after`; wait while there is none.

    In network namespaces, which keep domains apart by themselves, it is any but `after`.

    Raises:
        GraderError: none became free.
    """
    if namespaces.confinement() is namespaces.Confinement.NAMESPACES:
        yield random.choice([number for number in LOW if number != after])
        return
    identity, deadline = secrets.token_hex(8), time.monotonic() + _WAIT_S
    choices = [number for each in (HIGH, LOW) for number in random.sample(each, len(each)) if number != after]
    choices += [after] * (after > 0)
    while True:
        if (found := next(((n, held) for n in choices if (held := claim(n, identity))), None)) is not None:
            break
        if time.monotonic() > deadline:
            words = mark("All {n} ROS domains of this machine are in use. Run fewer gradings at a time (--jobs).")
            raise GraderError(say(words, n=len(choices)))
        time.sleep(random.uniform(0.5, 1.5) * _LOOK_S)  # not in step with another who has just seen this claim
    number, held = found
    with held:
        yield number


def _users(number: int) -> set[str]:
    """Return who has claimed a domain."""
    start = f"@{_PREFIX}/{number}/"
    names = (line.rpartition(" ")[2] for line in _SOCKETS.read_text(errors="replace").splitlines())
    return {name.removeprefix(start).partition("/")[0] for name in names if name.startswith(start)}
