"""A package `demo` whose executables are shell scripts, and fixtures that launch it, or only visit what would start."""

from __future__ import annotations

import asyncio
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from helpers.ros2_runs import COMMAND, FILES, Launcher, environment, tidy

from grader.ros2.launching import modules
from grader.ros2.launching.entities import LaunchContext

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


class Visitor:
    """Visits actions like a launch, but starts nothing."""

    def __init__(self, demo: Path, folder: Path) -> None:
        self.names: dict[str, Any] = {}
        for module, names in modules.table().items():
            self.names |= names if not module.startswith("launch.events") else {}
        self.context = LaunchContext()
        self.context.asyncio_loop = self.loop = asyncio.new_event_loop()
        self.context.runner = self
        self.output = self
        self.said: list[str] = []
        self.files: list[str] = []
        self.started: list[Any] = []
        self.demo, self.folder, self.number = demo, folder, 0

    def __getattr__(self, name: str) -> Any:
        return self.names[name]

    def next_number(self) -> int:
        self.number += 1
        return self.number

    def parameter_file(self, text: str) -> Path:
        self.files.append(text)
        path = self.folder / f"launch_params_{len(self.files)}"
        path.write_text(text)
        return path

    def info(self, _name: str, text: str) -> None:
        self.said.append(text)

    warn = info

    def visit(self, *entities: Any) -> list[str]:
        """Visit them, and return the command lines of what would start."""
        for entity in entities:
            inner = entity.visit(self.context)
            if getattr(entity, "process_details", None):
                self.started.append(entity)
            self.visit(*(inner or ()))
        return [tidy(" ".join(one.process_details["cmd"]), self.demo) for one in self.started]

    def launch(self, file: Path, *given: tuple[str, str]) -> list[str]:
        """Read a launch file with the names in place, visit it with arguments, and return the command lines."""
        finders = list(sys.meta_path)
        modules.install()
        try:
            return self.visit(self.IncludeLaunchDescription(str(file), launch_arguments=given))
        finally:
            sys.meta_path[:] = finders
            for name in [name for name in sys.modules if name.split(".")[0] in ("launch", "launch_ros")]:
                del sys.modules[name]

    def text(self, substitution: Any) -> str:
        return str(substitution.perform(self.context))

    def parameters(self, values: dict[str, Any], **rest: Any) -> dict[str, Any]:
        """Return the parameters in the file that is written for a dictionary."""
        import yaml

        self.visit(self.Node(package="demo", executable="show", parameters=[values], **rest))
        ((self.key, body),) = yaml.safe_load(self.files[-1]).items()
        found: dict[str, Any] = body["ros__parameters"]
        return found


@pytest.fixture
def visitor(demo: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.setenv("AMENT_PREFIX_PATH", f"{demo}:{sys.prefix}")
    made = Visitor(demo, tmp_path)
    before = dict(os.environ)
    yield made
    os.environ.clear()
    os.environ.update(before)
    if never_started := asyncio.all_tasks(made.loop):
        for task in never_started:
            task.cancel()
        made.loop.run_until_complete(asyncio.wait(never_started))
    made.loop.close()
