"""Run the `ros2` command and launches, and read the records of these."""

from __future__ import annotations

import json
import re
import signal
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from grader import KIT
from helpers import until

COMMAND = KIT / "grader" / "ros2"  # a folder that Python runs, as in the grader's sandbox
FILES = KIT / "tests" / "grader" / "ros2" / "launch_files"


@dataclass
class Run:
    """The result of a launch."""

    code: int
    out: str
    err: str
    events: list[dict[str, Any]]
    prefix: Path

    @property
    def commands(self) -> list[str]:
        """The command lines in the order of the labels, without the folders of this run."""
        found = {e["process"]: " ".join(e["cmd"]) for e in self.events if e["event"] == "started"}
        ordered = sorted(found.items(), key=lambda item: int(item[0].rpartition("-")[2]))
        return [tidy(text, self.prefix) for _, text in ordered]

    def ended(self, process: str) -> dict[str, Any]:
        """Return the last record of how a process ended."""
        return next(e for e in reversed(self.events) if e["event"] == "ended" and e["process"] == process)


def tidy(text: str, prefix: Path) -> str:
    """Return a command line without the parts that differ from run to run."""
    text = re.sub(r"\S*/launch_params_\S+", "DICT", text)
    text = text.replace(f"{prefix}/lib/demo/", "").replace(f"{prefix}/share/demo", "SHARE")
    return text.replace(str(FILES), "HERE")


def environment(prefix: Path, home: Path, **more: str) -> dict[str, str]:
    """Return an environment built from scratch."""
    return {
        "PATH": f"{sys.prefix}/bin:/usr/bin:/bin",
        "HOME": str(home),
        "AMENT_PREFIX_PATH": f"{prefix}:{sys.prefix}",
        "ROS_LOG_DIR": str(home / "log"),
        "TMPDIR": str(home),
        # Launching needs none of the wheels' libraries, so skip their second start of Python.
        "_ROS_WHEELS_BOOTSTRAP_COMPLETE": "1",
        "PYTHONDONTWRITEBYTECODE": "1",
        **more,
    }


def events(record: Path) -> list[dict[str, Any]]:
    """Return the events in a record so far."""
    return [json.loads(line) for line in record.read_text().splitlines()] if record.is_file() else []


class Launcher:
    """A running launch."""

    def __init__(self, prefix: Path, home: Path, file: str | Path, *args: str, **more: str) -> None:
        self.prefix, self.record = prefix, home / "record.jsonl"
        path = file if isinstance(file, Path) else FILES / file
        self.process = subprocess.Popen(
            [sys.executable, COMMAND, "launch", "--record", self.record, path, *args],
            env=environment(prefix, home, **more),
            cwd=home,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )

    def wait_for(self, *processes: str) -> None:
        """Wait until the processes have started."""
        until(lambda: {e.get("process") for e in events(self.record) if e["event"] == "started"} >= set(processes))

    def signal(self, number: signal.Signals) -> None:
        """Signal only the launcher."""
        self.process.send_signal(number)

    def end(self) -> Run:
        """Wait for the end and return the result."""
        out, err = self.process.communicate(timeout=60)
        return Run(self.process.returncode, out, err, events(self.record), self.prefix)


HEAD = """
from launch import LaunchDescription
from launch.actions import *; from launch.conditions import *
from launch.event_handlers import *; from launch.events.process import *; from launch.substitutions import *
from launch_ros.actions import *; from launch_ros.descriptions import *; from launch_ros.substitutions import *

def demo(script, *words, **rest):
    return Node(package="demo", executable=script, arguments=list(words), output="screen", **rest)

def generate_launch_description():
    return LaunchDescription([{entities}])
"""


def write(folder: Path, *entities: str) -> Path:
    """Write a launch file of these entities, which begin in line 11."""
    file = folder / "made.launch.py"
    file.write_text(HEAD.format(entities=", ".join(entities)))
    return file
