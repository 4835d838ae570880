"""A package `demo` whose executables are shell scripts, and fixtures that launch it."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from helpers.ros2_runs import COMMAND, FILES, Launcher, environment

SCRIPTS = {
    "show": 'echo "ARGV $*"',
    "wait": "exec sleep 600",
    # Has a child of its own, which the kernel does not signal when the launcher dies.
    "family": 'sleep "$1" & wait',
    "stubborn": "trap '' INT TERM\nwhile :; do sleep 0.1; done",
    # Counts the signals, and ends a little later, so that a second signal would be counted.
    "counting": "trap 'n=$((n+1)); echo INT $n' INT\necho ready\nwhile [ -z \"$n\" ]; do sleep 0.05; done\n"
    "i=0; while [ $i -lt 6 ]; do sleep 0.05; i=$((i+1)); done; exit $n",
    "fail": "exit 3",
}


@pytest.fixture(scope="session")
def demo(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the prefix of a workspace that holds `demo`."""
    prefix = tmp_path_factory.mktemp("overlay")
    for name, text in SCRIPTS.items():
        script = prefix / "lib/demo" / name
        script.parent.mkdir(parents=True, exist_ok=True)
        script.write_text(f"#!/bin/sh\n{text}\n")
        script.chmod(0o755)
    marker = prefix / "share/ament_index/resource_index/packages/demo"
    config = prefix / "share/demo/config/demo.yaml"
    launch = prefix / "share/demo/launch/one.launch.py"
    for path in (marker, config, launch):
        path.parent.mkdir(parents=True, exist_ok=True)
    marker.touch()
    config.write_text("/**:\n  ros__parameters:\n    a: 1\n")
    launch.write_text((FILES / "plain_list.launch.py").read_text())
    return prefix


@pytest.fixture
def launch(demo: Path, tmp_path: Path) -> Iterator[Callable[..., Launcher]]:
    """Return a function that launches a file of `launch_files`, or a path."""
    started: list[Launcher] = []

    def start(file: str | Path, *args: str, **more: str) -> Launcher:
        started.append(Launcher(demo, tmp_path, file, *args, **more))
        return started[-1]

    yield start
    for one in started:
        if one.process.poll() is None:
            os.kill(one.process.pid, signal.SIGKILL)
            one.process.communicate()


@pytest.fixture
def ros2(demo: Path, tmp_path: Path) -> Callable[..., subprocess.CompletedProcess[str]]:
    """Return a function that runs the command with the package `demo` sourced."""

    def run(*words: str | Path, cwd: Path = tmp_path, **more: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [sys.executable, COMMAND, *words],
            env=environment(demo, tmp_path, **more),
            cwd=cwd,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=60,
            check=False,
        )

    return run
