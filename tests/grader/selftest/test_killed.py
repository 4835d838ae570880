"""A killed grader leaves nothing behind, and the next one completes."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from grader import KIT
from grader.host import tempdir


@pytest.mark.slow  # four gradings
@pytest.mark.ros
@pytest.mark.sandbox
def test_a_killed_grading_leaves_nothing_and_the_next_is_right():
    """Kill three gradings here; `kill_runs.py 100` kills more."""
    command, paths = [sys.executable, "tests/helpers/kill_runs.py", "3"], {"PYTHONPATH": f"{KIT}:{KIT / 'tests'}"}
    ended = subprocess.run(command, cwd=KIT, env=os.environ | paths, capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended.stdout + ended.stderr


def test_only_folders_of_ended_processes_are_removed(tmp_path: Path):
    dead = subprocess.Popen(["true"])
    dead.wait()
    ended, mine, other = (
        tmp_path / name for name in (f"grading-{dead.pid}-x", f"grading-{os.getpid()}-x", "grading-x-y")
    )
    for folder in (ended, mine, other):
        (folder / "sub").mkdir(parents=True)
    tempdir.sweep(tmp_path, "grading")
    assert sorted(tmp_path.iterdir()) == sorted([mine, other])
