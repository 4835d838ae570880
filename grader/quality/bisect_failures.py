"""Run a tool over text that may be hostile: with limits, and without the files that break it."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TypeVar

from grader.errors import GraderError
from grader.words import say

T = TypeVar("T")
R = TypeVar("R")

CPU_SECONDS = 60  # a whole package takes 1 to 2, one at the reading limits 20
_WALL_SECONDS = 300.0  # far above, for a busy machine: the limit on CPU time is the one that decides
_MAX_MEMORY = 2 * 1024**3  # bytes
_SEARCH_SECONDS = 120.0


def run_python(arguments: Sequence[str], folder: Path) -> subprocess.CompletedProcess[str] | None:
    """Run our Python with `arguments` in `folder`, isolated. Return None if it exceeded its limits or crashed."""
    limits = [f"--as={_MAX_MEMORY}", f"--cpu={CPU_SECONDS}", "--core=0"]
    command = ["prlimit", *limits, "--", sys.executable, "-I", *arguments]
    # The variable keeps the ROS wheels from starting Python a second time: no ROS is needed here.
    environment = {"PATH": os.environ.get("PATH", ""), "LANG": "C.UTF-8", "_ROS_WHEELS_BOOTSTRAP_COMPLETE": "1"}
    try:
        done = subprocess.run(
            command, cwd=folder, env=environment, stdin=subprocess.DEVNULL, capture_output=True, text=True,
            errors="replace", check=False, timeout=_WALL_SECONDS,
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        return None
    except OSError as error:
        raise GraderError(say("Cannot start prlimit ({why}). Install util-linux.", why=error)) from error
    return None if done.returncode < 0 or done.returncode > 128 else done


def run_without_culprits(run: Callable[[Sequence[T]], R | None], items: Sequence[T]) -> tuple[R | None, list[T]]:
    """Return what `run` returns for the items that it can take, and the items that make it fail (return None).

    Usually that is one run over all of them. When it fails, each is tried by itself, for as long as there is time.
    """
    result = run(items)
    if result is not None or not items:
        return result, []
    deadline = time.monotonic() + _SEARCH_SECONDS
    bad = [item for item in items if time.monotonic() > deadline or run([item]) is None]
    good = [item for item in items if item not in bad]
    result = run(good) if bad and good else None
    return (result, bad) if result is not None else (None, list(items))
