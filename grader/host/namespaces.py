"""What keeps submissions apart on this machine: namespaces, other users or nothing; network namespaces for our own."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Sequence
from enum import Enum
from pathlib import Path

from grader.errors import GraderError
from grader.words import mark, say

UNSAFE_VARIABLE = "ROS2_COURSE_KIT_UNSAFE_NO_SANDBOX"
UNSAFE_NOTICE = mark(
    "Graded with --unsafe-no-sandbox: the submission's code saw this machine's processes and network, and other "
    "gradings. Its points can be trusted no more than the submission itself."
)
USERS_NOTICE = mark(
    "Graded without namespaces, which this machine forbids: the submission's code ran as a user of its own, but in "
    "this machine's network and beside its processes. docs/containers.md lists what that does not hold."
)
NONE_NOTICE = mark(
    "Checked without namespaces and without other users: the package's code ran as the user who checks. For your own "
    "checks that is enough; no points are given so."
)
_WORK_VARIABLE = "ROS2_COURSE_KIT_NAMESPACES"  # "" if they work, else why not; what a grading starts inherits it
_PROBE_SECONDS = 60
# What a sandbox asks of bubblewrap, and no more: one for a node in its trial's network, and one without a network.
NODE_SANDBOX = ["bwrap", "--ro-bind", "/", "/", "--proc", "/proc", "--dev", "/dev", "--tmpfs", "/run"]
NODE_SANDBOX += ["--unshare-user", "--unshare-pid", "--unshare-ipc", "--die-with-parent", "--"]
SANDBOX = [*NODE_SANDBOX[:-1], "--unshare-net", "--"]
_ADMIN = 1 << 21  # CAP_SYS_ADMIN: by it a process may make namespaces without a user namespace


class Confinement(Enum):
    """What keeps a submission's code apart."""

    NAMESPACES = "namespaces"
    USERS = "users"
    NONE = "none"


def confinement() -> Confinement:
    """Return what keeps a submission's code apart here: namespaces; where those are forbidden, root's other users."""
    if sandbox_disabled():
        return Confinement.NONE
    if not refusal():
        return Confinement.NAMESPACES
    return Confinement.USERS if os.geteuid() == 0 else Confinement.NONE


def notice() -> str:
    """Return in a sentence what a report has to say of that; "" for namespaces."""
    if sandbox_disabled():
        return say(UNSAFE_NOTICE)
    return say({Confinement.USERS: USERS_NOTICE, Confinement.NONE: NONE_NOTICE}.get(confinement(), ""))


def refusal() -> str:
    """Return why bubblewrap cannot make a sandbox here, "" if it can. Tries it once for a grading and all it starts."""
    if _WORK_VARIABLE not in os.environ:
        os.environ[_WORK_VARIABLE] = _tried([*SANDBOX, "true"])
    return os.environ[_WORK_VARIABLE]


def _tried(command: Sequence[str]) -> str:
    try:
        ended = subprocess.run(command, capture_output=True, text=True, timeout=_PROBE_SECONDS, check=False)
    except FileNotFoundError:
        return say("bubblewrap is not installed")
    except subprocess.TimeoutExpired:  # on a busy machine: no reason to confine in a weaker way
        words = mark("bubblewrap did not answer for {seconds} s. Try again when this machine is less busy.")
        raise GraderError(say(words, seconds=_PROBE_SECONDS)) from None
    except OSError as error:
        return str(error)
    return "" if ended.returncode == 0 else last_line(ended)


def last_line(ended: subprocess.CompletedProcess[str]) -> str:
    """Return the last line of what a program that failed has said, or its exit status."""
    return (ended.stderr.strip().splitlines() or [f"exit status {ended.returncode}"])[-1].strip()[:200]


def inherited() -> dict[str, str]:
    """Return the environment variables that a process of a grading needs to confine submissions in the same way."""
    refusal()
    return {name: os.environ[name] for name in (UNSAFE_VARIABLE, _WORK_VARIABLE) if name in os.environ}


def private_network(command: Sequence[str]) -> list[str]:
    """Return the command line that runs a trusted `command` in a network namespace of its own, with loopback only.

    It keeps the host's /proc: over one mounted by bubblewrap, parts of which are read-only, the kernel would not let
    the sandboxes inside mount their own.
    """
    if confinement() is not Confinement.NAMESPACES:
        return list(command)
    outer = ["bwrap", "--dev-bind", "/", "/", "--tmpfs", "/dev/shm", "--unshare-net", "--unshare-ipc"]
    capabilities = Path("/proc/self/status").read_text().partition("CapEff:")[2].split()[0]
    if os.geteuid() == 0 and not int(capabilities, 16) & _ADMIN:
        outer.append("--unshare-user")  # by which root, in a container, may make the others
    return [*outer, "--die-with-parent", "--", *command]


def sandbox_disabled() -> bool:
    """Return whether --unsafe-no-sandbox was given: no isolation of processes and networks."""
    return os.environ.get(UNSAFE_VARIABLE) == "1"
