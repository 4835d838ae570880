"""Run a program that drives a real node, for the tests of the simulator."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest


def run_with_node(program: Path, *arguments: str | Path) -> dict[str, Any]:
    """Run a program in its own network namespace and return the JSON in its last line of output.

    Its nodes share no topics, ports or memory with other processes on this machine. Memory matters because Fast DDS
    has crashed in `destroy_node` after another process that shared memory with it was killed.
    """
    pytest.importorskip("rclpy", reason="no rclpy: make setup")
    if shutil.which("bwrap") is None:
        pytest.skip("no bubblewrap: make setup installs it, or prints the command")
    sandbox = ["bwrap", "--dev-bind", "/", "/", "--tmpfs", "/dev/shm", "--unshare-net", "--unshare-ipc"]
    settings = ["--setenv", "FASTDDS_BUILTIN_TRANSPORTS", "UDPv4", "--die-with-parent", "--"]
    command = [*sandbox, *settings, sys.executable, program, *arguments]
    done = subprocess.run(command, cwd=program.parent, capture_output=True, text=True, check=False, timeout=120)
    assert done.returncode == 0, done.stderr
    answer: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return answer
