"""How tests of the simulator run a program that drives a real node."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest


def run_with_node(program: Path, *words: str | Path) -> dict[str, Any]:
    """Run a program in a network of its own and return what it says in JSON as its last line.

    Its nodes hear nothing of what others on this machine say, take no port, and share no memory: Fast DDS
    has been seen to crash in `destroy_node` after another process was killed that shared memory with it.
    """
    pytest.importorskip("rclpy", reason="no rclpy: make setup")
    if shutil.which("bwrap") is None:
        pytest.skip("no bubblewrap: make setup installs it, or names the command")
    wall = ["bwrap", "--dev-bind", "/", "/", "--tmpfs", "/dev/shm", "--unshare-net", "--unshare-ipc"]
    settings = ["--setenv", "FASTDDS_BUILTIN_TRANSPORTS", "UDPv4", "--die-with-parent", "--"]
    command = [*wall, *settings, sys.executable, program, *words]
    done = subprocess.run(command, cwd=program.parent, capture_output=True, text=True, check=False, timeout=120)
    assert done.returncode == 0, done.stderr
    answer: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return answer
